"""Shapes for drawing imported bodies. A body has one simple shape if that shape shows the whole body, else a surface mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from itertools import pairwise
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.importers.pose_matrices import Pose
from trunnion.scene.queries.packed_surfaces import packed

AROUND = 20
"""Number of sides of the polygon that replaces a circle."""
FACES = 800
"""Largest number of triangles in a body's surface. A finer surface is coarsened."""
FINEST = 96
"""Number of cells along the longest side of the finest grid. Points in one cell are merged. If too many triangles remain, a coarser
grid is used."""
NEAR = 1e-6
"""Largest allowed deviation of a solid's pose from the pose of the scene's shape, relative to the solid's size."""


@dataclass(frozen=True)
class Solid:
    """A solid with pose ``at`` in the body. ``kind`` determines ``sizes``, m: "box" (three edges), "cylinder" or "capsule"
    (radius, length of the straight part along z), "sphere" (radius), "ellipsoid" (three radii). A "mesh" has no sizes, but
    ``corners`` (n×3×3), m."""

    kind: str
    sizes: tuple[float, ...]
    at: Pose
    corners: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3)))

    def triangles(self) -> np.ndarray:
        """Corners (n×3×3) of triangles on the solid's surface, in the body's frame, m."""
        own = self.corners if self.kind == "mesh" else _triangles(self.kind, self.sizes)
        return own @ self.at[:3, :3].T + self.at[:3, 3]


def _triangles(kind: str, sizes: Sequence[float]) -> np.ndarray:
    if kind == "box":
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(sizes) / 2
        sides = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
        return corners[np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])]
    polar = np.pi * np.arange(AROUND // 2 + 1) / (AROUND // 2)
    r = 1.0 if kind == "ellipsoid" else sizes[0]
    half = sizes[1] / 2 if kind in ("cylinder", "capsule") else 0.0
    round_ = [(r * np.sin(p), r * np.cos(p) + np.sign(np.cos(p).round(9)) * half) for p in polar]
    profile = [(0.0, half), (r, half), (r, -half), (0.0, -half)] if kind == "cylinder" else round_
    if kind == "capsule":
        middle = len(profile) // 2
        profile = [*profile[:middle], (r, half), (r, -half), *profile[middle + 1 :]]
    return _revolved(np.array(profile)) * (np.array(sizes) if kind == "ellipsoid" else 1.0)


def _revolved(profile: np.ndarray) -> np.ndarray:
    """Triangles of the surface of revolution about z of a profile, given as rows (radius, z) from the top down."""
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    rings = [np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(AROUND, z)]) for r, z in profile]
    out = []
    for a, b in pairwise(rings):
        c, d = np.roll(b, -1, axis=0), np.roll(a, -1, axis=0)
        out += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    return np.concatenate(out)


def drawn(solids: Sequence[Solid], center: np.ndarray) -> dict[str, Any]:
    """Scene keys for drawing a body with mass centre ``center`` (3), m."""
    able = [s for s in solids if len(s.corners) or (s.sizes and all(x > 0 for x in s.sizes))]
    if len(able) == 1 and (shape := _shape(able[0], center)):
        return shape
    corners = np.concatenate([np.zeros((0, 3, 3)), *(s.triangles() for s in able)])
    corners = corners[np.isfinite(corners).all(axis=(1, 2))]
    if not len(corners):
        return {}
    points, faces = coarse(corners)
    return {"surface": packed(points.tolist(), faces.tolist())} if len(faces) else {}


def _shape(s: Solid, center: np.ndarray) -> dict[str, Any]:
    """The scene key of a simple shape. The result is empty unless the solid is centred on the mass centre and parallel to the
    body's axes."""
    turned = np.abs(s.at[:3, :3])
    size = max(s.sizes, default=0.0)
    if s.kind not in ("box", "cylinder", "sphere") or np.abs(s.at[:3, 3] - center).max() > NEAR * size:
        return {}
    if s.kind == "sphere":
        return {"sphere": float(s.sizes[0])}
    if np.abs(turned - turned.round()).max() > NEAR:
        return {}
    if s.kind == "cylinder":
        axis = "xyz"[int(np.argmax(turned[:, 2]))]
        return {"cylinder": {"radius": float(s.sizes[0]), "length": float(s.sizes[1]), "axis": axis}}
    return {"box": [float(f"{x:.12g}") for x in turned.round() @ np.array(s.sizes)]}


def coarse(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(points (p×3), faces (n×3)) of triangles (m×3×3). Points in one cell of a grid are merged. The grid is coarsened until n is
    at most ``FACES``."""
    low = corners.reshape(-1, 3).min(axis=0)
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max()) or 1.0
    cells, exact = FINEST, len(corners) <= FACES
    while True:
        spots = np.round((corners.reshape(-1, 3) - low) / size * (1e6 if exact else cells)).astype(int)
        _, first, which = np.unique(spots, axis=0, return_index=True, return_inverse=True)
        which = which.reshape(-1)
        faces = which.reshape(-1, 3)
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        if len(faces):
            faces = faces[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]]
        if len(faces) <= FACES or cells < 2:
            break
        exact, cells = False, int(cells * 0.8)
    count = np.bincount(which).astype(float)[:, None]
    points = np.zeros((len(first), 3))
    np.add.at(points, which, corners.reshape(-1, 3))
    used, faces = np.unique(faces, return_inverse=True)
    return (points / count)[used], faces.reshape(-1, 3)
