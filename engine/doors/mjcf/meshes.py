"""Meshes of MJCF as triangles, from files (STL, OBJ, MSH) and from the model itself, and the solids that MuJoCo takes them for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

LARGEST = 200_000_000
"""Bytes in a mesh, at most."""
STL = np.dtype([("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("more", "<u2")])
WAYS = ("legacy", "exact", "convex")
"""How a mesh is taken for a solid that are known here."""


class Unreadable(ValueError):
    """A mesh that cannot be read, and why."""


@dataclass(frozen=True)
class Solid:
    """volume, m³; center (3), m; inertia per density about the centre (3×3), m⁵."""

    volume: float
    center: np.ndarray
    inertia: np.ndarray


def triangles(path: Path) -> np.ndarray:
    """The corners of a mesh's triangles (n×3×3), in its file's numbers."""
    if path.stat().st_size > LARGEST:
        raise Unreadable(f"it is larger than {LARGEST // 1_000_000} MB")
    content, kind = path.read_bytes(), path.suffix.lower()
    if kind not in READERS:
        raise Unreadable(f"{kind or 'a file without suffix'} is none of {', '.join(READERS)}")
    try:
        return READERS[kind](content)
    except (ValueError, IndexError, UnicodeDecodeError) as e:
        raise Unreadable(f"it is damaged: {e}") from e


def _stl(content: bytes) -> np.ndarray:
    count = int.from_bytes(content[80:84], "little")
    if len(content) == 84 + STL.itemsize * count:
        return np.frombuffer(content, STL, count, 84)["points"].astype(float)
    words = content.decode("ascii").split()
    corners = [[float(x) for x in words[i + 1 : i + 4]] for i, word in enumerate(words) if word == "vertex"]
    return np.array(corners, float).reshape(-1, 3, 3)


def _obj(content: bytes) -> np.ndarray:
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for line in content.decode("utf-8", "replace").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(x) for x in words[1:4]])
        elif words[:1] == ["f"]:
            at = [int(w.split("/")[0]) for w in words[1:]]
            ring = [i - 1 if i > 0 else len(vertices) + i for i in at]
            faces += [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]
    return np.array(vertices, float)[np.array(faces, int).reshape(-1, 3)]


def _msh(content: bytes) -> np.ndarray:
    """MuJoCo's own: numbers of vertices, normals, texture coordinates and faces, then these."""
    nv, nn, nt, nf = np.frombuffer(content, "<i4", 4)
    points = np.frombuffer(content, "<f4", 3 * nv, 16).reshape(-1, 3).astype(float)
    faces = np.frombuffer(content, "<i4", 3 * nf, 16 + 4 * (3 * nv + 3 * nn + 2 * nt)).reshape(-1, 3)
    return points[faces]


READERS = {".stl": _stl, ".obj": _obj, ".msh": _msh}


def solid(corners: np.ndarray, way: str) -> Solid:
    """The solid inside triangles (n×3×3). way: exact; legacy, which counts every tetrahedron from the surface's middle as positive;
    convex, of the hull."""
    if way == "convex":
        corners, way = hull(corners.reshape(-1, 3)), "legacy"
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    apex = (area[:, None] * corners.mean(axis=1)).sum(axis=0) / area.sum() if way == "legacy" else np.zeros(3)
    parts = _volumes(corners - apex, way)
    center = apex + (parts[:, None] * (corners - apex).sum(axis=1) / 4).sum(axis=0) / parts.sum()
    arms = corners - center  # the legacy way looks again, from the mass centre that it found: its volume is then another
    parts, total = _volumes(arms, way), arms.sum(axis=1)
    second = (np.einsum("nki,nkj,n->ij", arms, arms, parts) + np.einsum("ni,nj,n->ij", total, total, parts)) / 20
    return Solid(float(parts.sum()), center, np.trace(second) * np.eye(3) - second)


def _volumes(corners: np.ndarray, way: str) -> np.ndarray:
    """Volumes of the tetrahedra between triangles (n×3×3) and the origin (n)."""
    parts = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    return np.abs(parts) if way == "legacy" else parts


def hull(points: np.ndarray) -> np.ndarray:
    """The triangles (n×3×3) of the convex hull of points (n×3)."""
    from engine.basics.extras import brought

    spatial = brought("scipy.spatial", "analysis", "the convex hull of a mesh")
    return points[spatial.ConvexHull(points).simplices]
