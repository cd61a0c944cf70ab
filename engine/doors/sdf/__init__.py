"""SDF, the format of Gazebo: frames told relative to each other (``frames``), models (``models``), links and joints (``door``)."""

from engine.doors.sdf.door import scene_of_sdf

__all__ = ["scene_of_sdf"]
