"""MJCF: the file with includes, settings and classes (``model``), masses of geoms, bodies and joints, what closes loops."""

from trunnion.importers.mjcf.scene_builder import scene_of_mjcf

__all__ = ["scene_of_mjcf"]
