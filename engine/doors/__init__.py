"""Ways in from other programs' files: scenes from URDF, MJCF, SDF and ASMT, bodies from meshes (``trunnion[cad]``)."""

from engine.doors.asmt import scene_of_asmt
from engine.doors.mesh import body_of_mesh
from engine.doors.mjcf import scene_of_mjcf
from engine.doors.opening import scene_of
from engine.doors.sdf import scene_of_sdf
from engine.doors.urdf import scene_of_urdf

__all__ = ["body_of_mesh", "scene_of", "scene_of_asmt", "scene_of_mjcf", "scene_of_sdf", "scene_of_urdf"]
