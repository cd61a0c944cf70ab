"""Bundled models: every folder of ``models`` that holds a scene.yaml."""

from __future__ import annotations

from pathlib import Path

from engine.basics.problems import Problem, SceneError
from engine.scene.suggest import did_you_mean, shown

SCENE_FILE = "scene.yaml"


def models_dir() -> Path:
    """The folder of the bundled models: inside the installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "_models"
    return installed if installed.is_dir() else package.parent / "models"


def model_names() -> list[str]:
    """Names of the bundled models."""
    folder = models_dir()
    return sorted(p.parent.name for p in folder.glob(f"*/{SCENE_FILE}")) if folder.is_dir() else []


def model_file(name: str) -> Path:
    """The scene file of a bundled model; SceneError with close names when there is none."""
    names = model_names()
    if name not in names:
        hint = did_you_mean(name, names, "bundled models")
        raise SceneError([Problem(name, f"neither a file nor a bundled model is called {shown(name, 60)}", hint)])
    return models_dir() / name / SCENE_FILE
