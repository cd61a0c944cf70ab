"""Importers for files of other programs. Files in URDF, MJCF, SDF and ASMT become scenes; meshes become bodies
(``trunnion[cad]``)."""

from trunnion.importers.format_detection import scene_of
from trunnion.importers.freecad_asmt import scene_of_asmt
from trunnion.importers.mesh_mass_properties import body_of_mesh
from trunnion.importers.mjcf import scene_of_mjcf
from trunnion.importers.sdf import scene_of_sdf
from trunnion.importers.urdf import scene_of_urdf
from trunnion.importers.urdf_export import urdf_of_scene

__all__ = ["body_of_mesh", "scene_of", "scene_of_asmt", "scene_of_mjcf", "scene_of_sdf", "scene_of_urdf", "urdf_of_scene"]
