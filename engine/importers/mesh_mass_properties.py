"""A body from a closed surface mesh (STL, or any format that trimesh reads). The body has mass, mass centre and inertia of the
solid inside the surface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.importers.xml_reader import existing

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
OVERLAP = 1e-6
"""Factor on the mass. A smaller difference between the union and its parts is only rounding error of single precision in STL
files."""
PLACES = 12
"""Number of significant digits in the result. Further digits are rounding errors."""


def body_of_mesh(file: str | Path, density: float, unit: str = "mm", notes: list[str] | None = None) -> dict[str, Any]:
    """The scene keys of a body, in the mesh's frame: mass, kg; center, m; inertia about the centre (xx, yy, zz, xy, xz, yz),
    kg m²; box with the extents of the mesh for drawing, m.

    ``density`` is in kg/m³; ``unit`` is the unit of the file's numbers (STL has no units). Closed surfaces that overlap count as
    one solid, their union. A note about the union is added to ``notes``. SceneError for an open or inverted surface, a density that
    is not positive, an unknown unit, or an unreadable file."""
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
    raise_problems(problems)
    mesh.apply_scale(UNITS[unit])
    apart = density * mesh.volume
    mesh = _united(mesh, str(file))
    mesh.density = density
    if notes is not None and abs(apart - mesh.mass) > OVERLAP * apart:
        notes.append(f"its surfaces overlap: the mass of their union is {mesh.mass:.6g} kg; counted one by one, {apart:.6g} kg")
    inertia = np.array(mesh.moment_inertia)
    six = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    small = 1e-12 * np.abs(six).max()
    return {
        "mass": _round(mesh.mass), "center": [_round(x) for x in mesh.center_mass],
        "inertia": [_round(x) if abs(x) > small else 0.0 for x in six], "box": [_round(x) for x in mesh.extents],
    }  # fmt: skip


def _united(mesh: Any, file: str) -> Any:
    """The union of the solids in a mesh, or the mesh itself if no solids overlap. A surface with outward normals bounds a solid. A
    surface with inward normals inside it bounds a cavity."""
    shells = sorted(mesh.split(), key=lambda shell: abs(shell.volume))
    boxes = [shell.bounds for shell in shells]
    near = any(np.all(a[0] < b[1]) and np.all(b[0] < a[1]) for i, a in enumerate(boxes) for b in boxes[:i])
    if not near:
        return mesh
    try:
        import manifold3d
    except ImportError as e:
        what = "it has several surfaces, of which some may overlap; manifold3d, which unites them, is not installed"
        raise SceneError([Problem(file, what, "pip install 'trunnion[cad]'")]) from e
    del manifold3d
    from trimesh import boolean

    outer = [shell for shell in shells if shell.volume > 0]
    inside: list[list[Any]] = [[] for _ in outer]
    for cavity in (shell for shell in shells if shell.volume <= 0):
        cavity.invert()
        for shell, holes in zip(outer, inside, strict=True):
            if boolean.intersection([shell, cavity], engine="manifold").volume > (1 - OVERLAP) * cavity.volume:
                holes.append(cavity)
                break
    solids = [boolean.difference([s, *holes], engine="manifold") if holes else s for s, holes in zip(outer, inside, strict=True)]
    return boolean.union(solids, engine="manifold") if len(solids) > 1 else solids[0]


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
