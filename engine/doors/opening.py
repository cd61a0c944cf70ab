"""Which door a file goes through: by its root element, or its suffix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from engine.basics.problems import Problem, SceneError
from engine.doors.asmt import scene_of_asmt
from engine.doors.mjcf import scene_of_mjcf
from engine.doors.sdf import scene_of_sdf
from engine.doors.urdf import scene_of_urdf
from engine.doors.xml import read_xml
from engine.scene.model import Scene

TEXT = ".asmt"
SUFFIXES = (".urdf", ".xml", ".mjcf", ".sdf", ".world", TEXT)
"""Of files that hold whole mechanisms."""
DOORS: dict[str, Callable[[str | Path, float | None], tuple[Scene, list[str]]]] = {
    "robot": scene_of_urdf, "mujoco": scene_of_mjcf, "sdf": scene_of_sdf,
}  # fmt: skip
"""By root element."""


def scene_of(file: str | Path, unit: str = "mm", stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on what was left out) of another program's file. unit: of lengths in a file that does not say (ASMT).
    stops: stiffness of limits, N/m and N m/rad; None leaves them out.
    SceneError with all that is wrong with it."""
    path = Path(file)
    if not path.is_file():
        raise SceneError([Problem(str(file), "there is no such file")])
    if path.suffix.lower() == TEXT:
        return scene_of_asmt(path, unit)
    root = read_xml(path)
    if root.tag not in DOORS:
        known = ", ".join(f"<{tag}>" for tag in DOORS)
        raise SceneError([Problem("file", f"begins with <{root.tag}>", f"known are {known}", str(file), root.line)])
    return DOORS[root.tag](path, stops)
