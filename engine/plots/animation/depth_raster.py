"""Draws triangles and lines into pixels with a depth buffer, so that films need no browser."""

from __future__ import annotations

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.plots.geometry.meshes import Mesh

LIGHT = np.array([-0.35, 0.75, 0.6]) / np.linalg.norm([-0.35, 0.75, 0.6])
"""Direction of the light in the axes of the picture (right, up, towards the viewer)."""
DARK, DULL, BRIGHT = 0.38, 0.68, 0.36
"""DARK: brightness of edges. DULL: brightness of an unlit face. BRIGHT: brightness that light adds to a face."""
NEARER = 2e-3
"""Lines on faces are shifted towards the viewer by this fraction of the picture's width, so that the faces do not hide the
lines."""
CREASE = np.cos(np.radians(40.0))


@dataclass(frozen=True)
class Solid:
    """A mesh for ``Sheet.solid``: vertices (n × 3), triangles (m × 3), the face of each triangle, normals of the faces.

    creases: edges (k × 2) that are always drawn. smooth: edges (l × 2) that are drawn only on the outline. There, only one of the
    two faces (``sides``) at the edge faces the viewer.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    of: np.ndarray
    normals: np.ndarray
    creases: np.ndarray
    smooth: np.ndarray
    sides: np.ndarray

    @classmethod
    def made(cls, mesh: Mesh) -> Solid:
        """The solid of a mesh. Vertices at the same place are merged."""
        vertices, ids = np.unique(mesh.vertices.round(9), axis=0, return_inverse=True)
        faces = [[int(ids[i]) for i in f] for f in mesh.faces]
        triangles = [((f[0], f[k], f[k + 1]), n) for n, f in enumerate(faces) for k in range(1, len(f) - 1)]
        normals = np.array([_normal(vertices[f]) for f in faces])
        beside: dict[tuple[int, int], list[int]] = {}
        for n, f in enumerate(faces):
            for a, b in zip(f, f[1:] + f[:1], strict=True):
                if a != b:
                    beside.setdefault((min(a, b), max(a, b)), []).append(n)
        bends = {e: float(normals[s[0]] @ normals[s[1]]) if len(s) == 2 else -1.0 for e, s in beside.items()}
        smooth = [e for e, bend in bends.items() if CREASE <= bend < 0.99999]
        return cls(
            vertices, np.array([t for t, _ in triangles]), np.array([n for _, n in triangles]), normals,
            np.array([e for e, bend in bends.items() if bend < CREASE], int).reshape(-1, 2),
            np.array(smooth, int).reshape(-1, 2), np.array([beside[e] for e in smooth], int).reshape(-1, 2),
        )  # fmt: skip


def _normal(corners: np.ndarray) -> np.ndarray:
    n = sum((np.cross(corners[k] - corners[0], corners[k + 1] - corners[0]) for k in range(1, len(corners) - 1)), np.zeros(3))
    return np.asarray(n / max(float(np.linalg.norm(n)), 1e-300))


class Sheet:
    """Pixels with depth. shade: colours from 0 to 1 (height × width × 3); depth: towards the viewer, −inf in empty pixels."""

    def __init__(self, width: int, height: int):
        self.width, self.height = width, height
        self.shade = np.ones((height, width, 3), np.float32)
        self.depth = np.full((height, width), -np.inf, np.float32)
        self.x, self.y = np.arange(width, dtype=np.float32) + 0.5, (np.arange(height, dtype=np.float32) + 0.5)[:, None]

    def solid(self, s: Solid, corners: np.ndarray, turn: np.ndarray, color: np.ndarray, edges: bool = True) -> None:
        """Draw a mesh.

        corners: vertices of the mesh in the picture (n × 3: right, down, towards the viewer, pixels). turn: rotation from the axes
        of the mesh to the axes of the picture (right, up, towards the viewer).
        """
        normals = s.normals @ turn.T
        light = DULL + BRIGHT * np.maximum(normals @ LIGHT, 0.0)
        front = normals[:, 2] > 0
        kept = front[s.of]
        self.triangles(corners[s.triangles[kept]], light[s.of[kept]][:, None] * color)
        if edges:
            rim = s.smooth[front[s.sides[:, 0]] != front[s.sides[:, 1]]]
            self.lines(corners[np.concatenate([s.creases, rim])], DARK * color)

    def triangles(self, corners: np.ndarray, colors: np.ndarray) -> None:
        """Fill triangles (n × 3 × 3, pixels) with their colours (n × 3), except where something else is nearer to the viewer."""
        p, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        keep = np.abs(area) > 1e-9
        p, u, v, area, corners, colors = (a[keep] for a in (p, u, v, area, corners, colors))
        r = np.column_stack([v[:, 1], -v[:, 0]]) / area[:, None]
        s = np.column_stack([-u[:, 1], u[:, 0]]) / area[:, None]
        z = r * u[:, 2:] + s * v[:, 2:]
        low = np.clip(np.floor(corners[:, :, :2].min(axis=1) - 0.5), 0, [self.width, self.height]).astype(int)
        high = np.clip(np.ceil(corners[:, :, :2].max(axis=1) + 0.5), 0, [self.width, self.height]).astype(int)
        for i in np.flatnonzero((high > low).all(axis=1)):
            columns, rows = slice(low[i, 0], high[i, 0]), slice(low[i, 1], high[i, 1])
            dx, dy = self.x[columns] - p[i, 0], self.y[rows] - p[i, 1]
            a, b = r[i, 0] * dx + r[i, 1] * dy, s[i, 0] * dx + s[i, 1] * dy
            depth = self.depth[rows, columns]
            deep = p[i, 2] + (z[i, 0] * dx + z[i, 1] * dy)
            seen = (a >= 0) & (b >= 0) & (a + b <= 1) & (deep > depth)
            depth[seen] = deep[seen]
            self.shade[rows, columns][seen] = colors[i]

    def lines(self, ends: np.ndarray, color: np.ndarray, wide: int = 2, nearer: float = NEARER) -> None:
        """Draw lines (n × 2 × 3, pixels) in one colour, except where something else is nearer to the viewer."""
        if not len(ends):
            return
        extent = np.abs(ends[:, 1, :2] - ends[:, 0, :2]).max(axis=1)
        steps = np.maximum(2, np.ceil(extent).astype(int) + 1)
        steps = np.minimum(steps, 4 * (self.width + self.height))
        which = np.repeat(np.arange(len(ends)), steps)
        part = (np.arange(len(which)) - np.repeat(np.cumsum(steps) - steps, steps)) / (steps[which] - 1)
        spots = ends[which, 0] + part[:, None] * (ends[which, 1] - ends[which, 0])
        deep = (spots[:, 2] + nearer * self.width).astype(np.float32)
        for i in range(wide):
            for j in range(wide):
                x, y = (np.floor(spots[:, k] - wide / 2 + o + 0.5).astype(int) for k, o in ((0, i), (1, j)))
                inside = (x >= 0) & (x < self.width) & (y >= 0) & (y < self.height)
                x, y, d = x[inside], y[inside], deep[inside]
                seen = d >= self.depth[y, x]
                self.shade[y[seen], x[seen]] = color
                np.maximum.at(self.depth, (y[seen], x[seen]), spots[inside, 2][seen].astype(np.float32))


def over(below: Sheet, above: Sheet, hidden: float) -> np.ndarray:
    """The colours of two sheets in one picture. Each pixel has the colour of the nearer sheet. Where ``above`` is behind ``below``,
    ``above`` shows through with the opacity ``hidden``."""
    picture, there = below.shade.copy(), np.isfinite(above.depth)
    front = there & (above.depth >= below.depth)
    picture[front] = above.shade[front]
    behind = there & ~front
    picture[behind] += hidden * (above.shade[behind] - picture[behind])
    return picture


def halved(picture: np.ndarray) -> np.ndarray:
    """A picture at half its size, as bytes. Each pixel is the mean of four pixels. Height and width of the picture must be even."""
    total = picture[0::2, 0::2] + picture[0::2, 1::2] + picture[1::2, 0::2] + picture[1::2, 1::2]
    return np.asarray((255 / 4 * total + 0.5).astype(np.uint8))
