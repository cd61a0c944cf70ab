"""A body from a closed surface mesh (STL, or any format that trimesh reads): mass, mass centre and inertia of the solid inside."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trunnion.basics.problems import Problem, SceneError
from trunnion.importers.xml_reader import existing

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
PLACES = 12
"""Number of significant digits in the result; further digits are round-off."""


def body_of_mesh(file: str | Path, density: float, unit: str = "mm") -> dict[str, Any]:
    """The scene keys of a body, in the mesh's frame: mass, kg; center, m; inertia about the centre (xx, yy, zz, xy, xz, yz),
    kg m²; box with the extents of the mesh for drawing, m.

    ``density`` is in kg/m³; ``unit`` is the unit of the file's numbers (STL has no units). SceneError for an open or inverted
    surface, a density that is not positive, an unknown unit, or an unreadable file."""
    mesh = _read(Path(file))
    problems = []
    if unit not in UNITS:
        problems.append(Problem("unit", f"{unit!r} is unknown", f"one of {', '.join(UNITS)}"))
    if not density > 0:
        problems.append(Problem("density", f"{density:g} kg/m³ is not positive", "steel: 7800, aluminium: 2700"))
    if not mesh.is_watertight:
        problems.append(Problem(str(file), "its surface is not closed, so the mesh has no volume", "export a solid, or repair it"))
    elif mesh.volume <= 0:
        problems.append(Problem(str(file), "its surface is inside out: the normals point inwards", "flip its normals"))
    if problems:
        raise SceneError(problems)
    mesh.apply_scale(UNITS[unit])
    mesh.density = density
    inertia = np.array(mesh.moment_inertia)
    six = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    small = 1e-12 * np.abs(six).max()
    return {
        "mass": _round(mesh.mass), "center": [_round(x) for x in mesh.center_mass],
        "inertia": [_round(x) if abs(x) > small else 0.0 for x in six], "box": [_round(x) for x in mesh.extents],
    }  # fmt: skip


def _round(x: float) -> float:
    return float(f"{float(x):.{PLACES}g}") + 0.0


def _read(file: Path) -> Any:
    try:
        import trimesh
    except ImportError as e:
        what = "meshes are read by trimesh, which is not installed"
        raise SceneError([Problem(str(file), what, "pip install 'trunnion[cad]'")]) from e
    existing(file)
    try:
        return trimesh.load_mesh(file)
    except Exception as e:  # any error of the mesh reader means that the file cannot be read
        raise SceneError([Problem(str(file), f"cannot be read as a mesh: {e}", "STL, OBJ or PLY")]) from e
