"""Scenes: the description of a mechanism as data classes, with reading, checking and writing of scene files. Each name is imported
at its first use."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trunnion.scene.checks import checked, problems
    from trunnion.scene.data_classes.scene import Scene
    from trunnion.scene.file_format.yaml_writer import scene_to_dict, scene_to_yaml
    from trunnion.scene.library.model_folders import model_names, models_dir
    from trunnion.scene.scene_loader import load_scene, scene_from_dict, scene_from_text

__all__ = [
    "Scene", "checked", "load_scene", "model_names", "models_dir", "problems", "scene_from_dict", "scene_from_text",
    "scene_to_dict", "scene_to_yaml",
]  # fmt: skip

_MODULES = {
    "checks": ("checked", "problems"),
    "data_classes.scene": ("Scene",),
    "file_format.yaml_writer": ("scene_to_dict", "scene_to_yaml"),
    "library.model_folders": ("model_names", "models_dir"),
    "scene_loader": ("load_scene", "scene_from_dict", "scene_from_text"),
}

if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        """Load a name from its module."""
        for module, names in _MODULES.items():
            if name in names:
                return getattr(import_module(f"{__name__}.{module}"), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
