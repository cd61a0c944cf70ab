"""Ways in from other programs' files: bodies from STL meshes, scenes from URDF. Both need the extra ``trunnion[cad]``."""

from engine.doors.mesh import body_of_mesh
from engine.doors.urdf import scene_of_urdf

__all__ = ["body_of_mesh", "scene_of_urdf"]
