"""What the bodies of a URDF look like: its visuals, meshes included, for pictures of the scene that was made from it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from engine.basics.extras import brought
from engine.basics.problems import Problem, SceneError
from engine.plots.meshes import FINE, Mesh, join, placed, solid
from engine.scene.refs import GROUND

MOST_FACES = 6000
"""Triangles of a body: more are not told apart in a picture, and make the page slow to open."""


def shapes_of_urdf(file: str | Path) -> dict[str, Mesh]:
    """{body: its visuals in its own frame, m}; a root link without mass is "ground". For ``engine.plots.animate(…, shapes=…)``.

    SceneError with every mesh that cannot be found or read; Missing without the extra ``cad`` where there are meshes.
    """
    path, out = Path(file), {}
    problems: list[Problem] = []
    try:
        robot = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError) as e:
        raise SceneError([Problem(str(file), f"cannot be read as URDF: {e}")]) from e
    children = {c.get("link") for c in robot.iterfind("joint/child")}
    for link in robot.iterfind("link"):
        name = link.get("name", "")
        pieces = []
        for visual in link.iterfind("visual"):
            try:
                pieces += list(_visual(visual, path))
            except SceneError as e:
                problems += e.problems
        if pieces:
            mass = link.find("inertial/mass")
            grounded = name not in children and (mass is None or not float(mass.get("value", 0.0)))
            out[GROUND if grounded else "".join(c if c.isalnum() or c == "_" else "_" for c in name)] = join(pieces)
    if problems:
        raise SceneError(problems)
    return out


def _visual(visual: ElementTree.Element, urdf: Path) -> Iterator[Mesh]:
    turn, place = _origin(visual.find("origin"))
    for shape in visual.iterfind("geometry/*"):
        if shape.tag == "mesh":
            mesh = read_mesh(_found(shape.get("filename", ""), urdf))
            mesh = Mesh(mesh.vertices * _numbers(shape.get("scale"), 3, 1.0), mesh.faces, mesh.edges)
        elif shape.tag == "box":
            mesh = solid("box", [float(x) for x in _numbers(shape.get("size"), 3, 0.0)], grain=FINE)
        elif shape.tag in ("cylinder", "sphere"):
            sizes = [float(shape.get(key, 0.0)) for key in ("radius", "length")]
            mesh = solid(shape.tag, sizes, 2, FINE)
        else:
            continue
        yield placed(mesh, turn, place)


def _numbers(text: str | None, count: int, otherwise: float) -> np.ndarray:
    return np.array([float(x) for x in text.split()]) if text else np.full(count, otherwise)


def _origin(origin: ElementTree.Element | None) -> tuple[np.ndarray, np.ndarray]:
    """(rotation, place) of an <origin xyz rpy>: roll, pitch and yaw about the fixed x, y, z."""
    if origin is None:
        return np.eye(3), np.zeros(3)
    (cr, cp, cy), (sr, sp, sy) = (f(_numbers(origin.get("rpy"), 3, 0.0)) for f in (np.cos, np.sin))
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return yaw @ pitch @ roll, _numbers(origin.get("xyz"), 3, 0.0)


def _found(name: str, urdf: Path) -> Path:
    """The file that a URDF names: beside it, or for package://… in any folder above it."""
    bare = name.removeprefix("file://")
    if "://" in bare:
        bare = bare.split("://", 1)[1]
    above = [urdf.resolve().parent, *urdf.resolve().parents] if "://" in name else [urdf.resolve().parent]
    wanted = [f / bare for f in above] + [f / bare.partition("/")[2] for f in above if "package://" in name]
    for file in wanted:
        if file.is_file():
            return file
    raise SceneError(
        [Problem(str(urdf), f"its mesh {name!r} is not there", "put it where the URDF names it, beside the file or above")]
    )


def read_mesh(file: str | Path) -> Mesh:
    """A mesh file (STL, OBJ, PLY and what else trimesh reads) in the file's own numbers, with at most ``MOST_FACES`` triangles."""
    trimesh = brought("trimesh", "cad", "drawing a mesh")
    try:
        read = trimesh.load(file, force="mesh")
        vertices, faces = np.asarray(read.vertices, float), np.asarray(read.faces, int)
    except Exception as e:  # any error of the mesh reader means that the file cannot be read
        raise SceneError([Problem(str(file), f"cannot be read as a mesh: {e}", "STL, OBJ or PLY")]) from e
    vertices, faces = coarser(vertices, faces, MOST_FACES)
    return Mesh(vertices, tuple(tuple(int(i) for i in f) for f in faces), (0,) * len(faces))


def coarser(vertices: np.ndarray, faces: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (n × 3) of vertices (m × 3), at most so many: vertices within the cells of a grid, made coarser until that is
    reached, become one, in their mean."""
    span = float(np.ptp(vertices, axis=0).max()) if len(vertices) else 0.0
    cells = 512.0
    while len(faces) > most and cells >= 2:
        grid = np.floor((vertices - vertices.min(axis=0)) / (span / cells)).astype(int)
        _, ids, count = np.unique(grid, axis=0, return_inverse=True, return_counts=True)
        merged = np.stack([np.bincount(ids, vertices[:, k]) / count for k in range(3)], axis=1)
        kept = ids[faces]
        kept = kept[(kept[:, 0] != kept[:, 1]) & (kept[:, 1] != kept[:, 2]) & (kept[:, 0] != kept[:, 2])]
        if len(kept) <= most:
            return merged, kept
        cells /= 1.3
    return vertices, faces
