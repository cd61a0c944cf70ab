"""Shapes as polygons: boxes, cylinders, spheres, rods and rings. The polygons are small enough for drawing from back to front."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass

ROUND = 20
"""Number of sides of a cylinder and of meridians of a sphere."""
SHARP = np.cos(np.deg2rad(40))
"""The common side of two triangles is drawn as an edge if the cosine of the angle between their normals is below this value."""
PIECES = 8
"""Largest number of pieces along the longer edge of a face. Small pieces are needed so that intersecting bodies hide each other
correctly."""


@dataclass(frozen=True)
class Grain:
    """Fineness of shapes: numbers of sides of a cylinder, meridians of a sphere, and pieces along an edge."""

    around: int = ROUND
    pieces: int = PIECES


SORTED, FINE = Grain(), Grain(around=48, pieces=1)
"""SORTED: grain for drawing from back to front. FINE: grain for drawing with a depth buffer, where long faces are harmless."""


@dataclass(frozen=True)
class Mesh:
    """A surface of polygons.

    vertices: n×3. faces: indices of vertices, counter-clockwise from outside. edges: for each face a bit mask of the sides that
    are edges of the shape; side k joins vertices k and k + 1.
    """

    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    edges: tuple[int, ...]


def box(a: float, b: float, c: float, grain: Grain = SORTED) -> Mesh:
    """A box centred at the origin with edges a, b, c along x, y, z, m."""
    half = np.array([a, b, c]) / 2
    shortest = max(min(a, b, c), 0.05 * max(a, b, c))
    parts = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        n, m = (int(np.clip(round(2 * half[k] / shortest), 1, grain.pieces)) for k in (u, v))
        for sign in (1.0, -1.0):
            parts.append(_face(axis, sign, half, n, m))
    return join(parts)


def _face(axis: int, sign: float, half: np.ndarray, n: int, m: int) -> Mesh:
    """One side of a box as n × m rectangles."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    grid = np.zeros((n + 1, m + 1, 3))
    grid[..., axis] = sign * half[axis]
    grid[..., u] = np.linspace(-half[u], half[u], n + 1)[:, None]
    grid[..., v] = np.linspace(-half[v], half[v], m + 1)[None, :]
    faces, edges = [], []
    for i in range(n):
        for j in range(m):
            a, b, c, d = (row * (m + 1) + k for row, k in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
            rim = [j == 0, i == n - 1, j == m - 1, i == 0]
            ring = (a, b, c, d)
            if sign < 0:
                ring, rim = (a, d, c, b), rim[::-1]
            faces.append(ring)
            edges.append(sum(bool(r) << k for k, r in enumerate(rim)))
    return Mesh(grid.reshape(-1, 3), tuple(faces), tuple(edges))


def cylinder(radius: float, length: float, axis: int = 0, grain: Grain = SORTED) -> Mesh:
    """A cylinder centred at the origin along x, y or z (axis 0, 1, 2); radius and length in m."""
    pieces = int(np.clip(round(length / max(2 * radius, 1e-9)), 1, grain.pieces))
    sides = grain.around
    turn = 2 * np.pi * np.arange(sides) / sides
    rings = [
        np.column_stack([np.full(sides, x), radius * np.cos(turn), radius * np.sin(turn)])
        for x in np.linspace(-length / 2, length / 2, pieces + 1)
    ]
    faces: list[tuple[int, ...]] = []
    edges = []
    for i in range(pieces):
        for k in range(sides):
            a, b = i * sides + k, i * sides + (k + 1) % sides
            faces.append((a, b, b + sides, a + sides))
            edges.append((1 if i == 0 else 0) | (4 if i == pieces - 1 else 0))
    faces += [tuple(range(sides))[::-1], tuple(range(pieces * sides, (pieces + 1) * sides))]
    edges += [0, 0]
    vertices = np.concatenate(rings)
    return Mesh(np.roll(vertices, axis, axis=1), tuple(faces), tuple(edges))


def sphere(radius: float, around: int = ROUND) -> Mesh:
    """A sphere centred at the origin, cut into ``around`` meridians; radius in m."""
    rows = around // 2
    polar, turn = np.pi * np.arange(rows + 1) / rows, 2 * np.pi * np.arange(around) / around
    p, t = (a.ravel() for a in np.meshgrid(polar, turn, indexing="ij"))
    vertices = radius * np.column_stack([np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)])
    faces = []
    for i in range(rows):
        for k in range(around):
            a, b = i * around + k, i * around + (k + 1) % around
            ring = (a, a + around, b + around, b)
            faces.append((a, a + around, b) if i == rows - 1 else (a, a + around, b + around) if i == 0 else ring)
    return Mesh(vertices, tuple(faces), (0,) * len(faces))


def surface(points: np.ndarray, faces: np.ndarray) -> Mesh:
    """A surface of triangles (indices, m×3) between points (n×3), m. Common sides of triangles are edges by the limit ``SHARP``."""
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    beside: dict[tuple[int, int], int] = {(int(f[k]), int(f[(k + 1) % 3])): i for i, f in enumerate(faces) for k in range(3)}

    def sharp(i: int, k: int) -> bool:
        other = beside.get((int(faces[i][(k + 1) % 3]), int(faces[i][k])))
        return other is None or bool(normals[i] @ normals[other] < SHARP)

    edges = tuple(sum(sharp(i, k) << k for k in range(3)) for i in range(len(faces)))
    return Mesh(points, tuple((int(a), int(b), int(c)) for a, b, c in faces), edges)


def ring(outlines: Sequence[np.ndarray], inside: bool = False) -> Mesh:
    """A ring about x between four closed outlines (n×3 each). The outlines are hole and rim at the low end, then hole and rim at
    the high end.

    inside: whether the rim is the inner outline. Edges are drawn only along the rim.
    """
    count, faces = len(outlines[0]), []
    for i in range(count):
        n = (i + 1) % count
        (low_in, low_in_n), (low_out, low_out_n), (high_in, high_in_n), (high_out, high_out_n) = (
            (i + m * count, n + m * count) for m in range(4)
        )
        quads = [
            (high_in, high_out, high_out_n, high_in_n), (low_in, low_in_n, low_out_n, low_out),
            (low_out, low_out_n, high_out_n, high_out), (low_in, high_in, high_in_n, low_in_n),
        ]  # fmt: skip
        faces += [q[::-1] for q in quads] if inside else quads
    return Mesh(np.concatenate(outlines), tuple(faces), (2, 2 if inside else 4, 5, 0) * count)


def solid(shape: str, sizes: Sequence[float], axis: int = 0, grain: Grain = SORTED) -> Mesh:
    """A "sphere" (radius), "cylinder" (radius, length; along ``axis``) or "box" (three edges), m."""
    if shape == "sphere":
        return sphere(sizes[0], grain.around)
    return cylinder(sizes[0], sizes[1], axis, grain) if shape == "cylinder" else box(sizes[0], sizes[1], sizes[2], grain)


def rod(start: np.ndarray, end: np.ndarray, radius: float) -> Mesh:
    """A thin square rod between two points."""
    p, q = np.asarray(start, float), np.asarray(end, float)
    along = q - p
    length = float(np.linalg.norm(along))
    return placed(box(length, 2 * radius, 2 * radius), rotation_to(along / length), (p + q) / 2)


def rotation_to(x: np.ndarray) -> np.ndarray:
    """A rotation matrix whose first column is the unit vector x."""
    y = np.cross(x, np.eye(3)[int(np.argmin(np.abs(x)))])
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def placed(mesh: Mesh, rotation: np.ndarray, position: np.ndarray) -> Mesh:
    """The mesh turned by a 3×3 rotation, then moved by a position (3)."""
    return Mesh(mesh.vertices @ np.asarray(rotation).T + position, mesh.faces, mesh.edges)


def join(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    faces: list[tuple[int, ...]] = []
    edges: list[int] = []
    first = 0
    for m in meshes:
        faces += [tuple(i + first for i in f) for f in m.faces]
        edges += m.edges
        first += len(m.vertices)
    vertices = np.concatenate([m.vertices for m in meshes]) if meshes else np.zeros((0, 3))
    return Mesh(vertices, tuple(faces), tuple(edges))
