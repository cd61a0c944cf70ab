"""Scenes: the description of a mechanism as data classes, with reading, checking and writing of scene files."""

from trunnion.scene.checks import checked, problems
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.yaml_writer import scene_to_dict, scene_to_yaml
from trunnion.scene.library.model_folders import model_names, models_dir
from trunnion.scene.scene_loader import load_scene, scene_from_dict, scene_from_text

__all__ = [
    "Scene", "checked", "load_scene", "model_names", "models_dir", "problems", "scene_from_dict", "scene_from_text",
    "scene_to_dict", "scene_to_yaml",
]  # fmt: skip
