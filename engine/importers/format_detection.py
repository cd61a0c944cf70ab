"""Selection of the importer by the file's root element or suffix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from trunnion.basics.errors import Problem, SceneError
from trunnion.importers.freecad_asmt import scene_of_asmt
from trunnion.importers.mjcf import scene_of_mjcf
from trunnion.importers.sdf import scene_of_sdf
from trunnion.importers.urdf import scene_of_urdf
from trunnion.importers.xml_reader import existing, read_xml
from trunnion.scene.data_classes.scene import Scene

TEXT = ".asmt"
SUFFIXES = (".urdf", ".xml", ".mjcf", ".sdf", ".world", TEXT)
"""Suffixes of files with whole mechanisms."""
DOORS: dict[str, Callable[[str | Path, float | None], tuple[Scene, list[str]]]] = {
    "robot": scene_of_urdf, "mujoco": scene_of_mjcf, "sdf": scene_of_sdf,
}  # fmt: skip
"""Importers by root element."""


def scene_of(file: str | Path, unit: str = "mm", stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on omissions) from a file of another program. ``unit`` is the unit of length for a file that states no units
    (ASMT). ``stops`` is the stiffness of end stops at joint limits, N/m and N m/rad; None omits the limits. SceneError with all
    faults."""
    path = existing(file)
    if path.suffix.lower() == TEXT:
        return scene_of_asmt(path, unit)
    root = read_xml(path)
    if root.tag not in DOORS:
        known = ", ".join(f"<{tag}>" for tag in DOORS)
        raise SceneError([Problem("file", f"begins with <{root.tag}>", f"supported: {known}", str(file), root.line)])
    return DOORS[root.tag](path, stops)
