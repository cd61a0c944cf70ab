"""Bundled models (the folders of ``models`` that hold a scene.yaml) and bundled designs (those of ``models/designer``)."""

from __future__ import annotations

from pathlib import Path

from trunnion.basics.errors import Problem, SceneError
from trunnion.scene.findings.name_suggestions import did_you_mean, shown

SCENE_FILE = "scene.yaml"
DESIGNS = "designer"
"""The folder of example mechanisms that use parameters, placed bodies and copies."""


def models_dir() -> Path:
    """The folder of the bundled models: inside the installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parents[2]
    installed = package / "_models"
    return installed if installed.is_dir() else package.parent / "models"


def model_names() -> list[str]:
    """Names of the bundled models."""
    folder = models_dir()
    return sorted(p.parent.name for p in folder.glob(f"*/{SCENE_FILE}")) if folder.is_dir() else []


def design_names() -> list[str]:
    """Names of the bundled designs."""
    return sorted(p.parent.name for p in (models_dir() / DESIGNS).glob(f"*/{SCENE_FILE}"))


def bundled_names() -> list[str]:
    """Names of the bundled models, then those of the designs."""
    return [*model_names(), *design_names()]


def model_folder(name: str) -> Path:
    """The folder of a bundled model or design with this name; the folder need not exist."""
    folder = models_dir() / DESIGNS / name
    return folder if (folder / SCENE_FILE).is_file() else models_dir() / name


def model_file(name: str) -> Path:
    """The scene file of a bundled model or design. SceneError suggests a close name when the name is unknown."""
    names = bundled_names()
    if name not in names:
        hint = did_you_mean(name, names, "bundled models")
        raise SceneError([Problem(name, f"neither a file nor a bundled model is called {shown(name, 60)}", hint)])
    return model_folder(name) / SCENE_FILE
