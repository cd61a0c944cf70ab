"""Scenes: the description of a mechanism as data classes, and everything between them and the user's files."""

from engine.scene.check import checked, problems
from engine.scene.dump import scene_to_dict, scene_to_yaml
from engine.scene.library import model_names, models_dir
from engine.scene.load import load_scene, scene_from_dict, scene_from_text
from engine.scene.model import Scene

__all__ = [
    "Scene", "checked", "load_scene", "model_names", "models_dir", "problems", "scene_from_dict", "scene_from_text",
    "scene_to_dict", "scene_to_yaml",
]  # fmt: skip
