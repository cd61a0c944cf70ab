"""Importer of SDF, the format of Gazebo. A file has models, links, joints, and frames relative to each other."""

from trunnion.importers.sdf.scene_builder import scene_of_sdf

__all__ = ["scene_of_sdf"]
