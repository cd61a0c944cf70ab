"""Importer of MJCF, the format of MuJoCo. The importer reads includes, settings, default classes, masses of geoms, bodies, joints
and equalities."""

from trunnion.importers.mjcf.scene_builder import scene_of_mjcf

__all__ = ["scene_of_mjcf"]
