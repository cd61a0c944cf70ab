"""Importer of SDF, the format of Gazebo: frames relative to each other, models, links and joints."""

from trunnion.importers.sdf.scene_builder import scene_of_sdf

__all__ = ["scene_of_sdf"]
