"""Importer of MJCF, the format of MuJoCo: includes, settings and default classes, masses of geoms, bodies, joints, equalities."""

from trunnion.importers.mjcf.scene_builder import scene_of_mjcf

__all__ = ["scene_of_mjcf"]
