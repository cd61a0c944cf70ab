"""Volume and inertia of MJCF meshes by the methods of MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

WAYS = ("legacy", "exact", "convex")
"""Supported methods for the volume and inertia of a mesh (MJCF attribute ``inertia``)."""


@dataclass(frozen=True)
class Solid:
    """Volume, m³; centre (3), m; inertia about the centre divided by the density (3×3), m⁵."""

    volume: float
    center: np.ndarray
    inertia: np.ndarray


def solid(corners: np.ndarray, way: str) -> Solid:
    """The solid inside triangles (n×3×3). The method ``way`` is one of:

    exact   signed volumes of tetrahedra
    legacy  absolute volumes of tetrahedra with their apex at the surface's centroid
    convex  the convex hull
    """
    if way == "convex":
        corners, way = hull(corners.reshape(-1, 3)), "legacy"
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    apex = (area[:, None] * corners.mean(axis=1)).sum(axis=0) / area.sum() if way == "legacy" else np.zeros(3)
    parts = _volumes(corners - apex, way)
    center = apex + (parts[:, None] * (corners - apex).sum(axis=1) / 4).sum(axis=0) / parts.sum()
    arms = corners - center  # the legacy method repeats the computation with the apex at this centre, which changes the volume
    parts, total = _volumes(arms, way), arms.sum(axis=1)
    second = (np.einsum("nki,nkj,n->ij", arms, arms, parts) + np.einsum("ni,nj,n->ij", total, total, parts)) / 20
    return Solid(float(parts.sum()), center, np.trace(second) * np.eye(3) - second)


def _volumes(corners: np.ndarray, way: str) -> np.ndarray:
    """Volumes (n) of the tetrahedra formed by the triangles (n×3×3) and the origin; absolute values for the legacy method."""
    parts = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    return np.abs(parts) if way == "legacy" else parts


def hull(points: np.ndarray) -> np.ndarray:
    """The triangles (n×3×3) of the convex hull of points (n×3)."""
    from trunnion.basics.optional_packages import brought

    spatial = brought("scipy.spatial", "analysis", "the convex hull of a mesh")
    return points[spatial.ConvexHull(points).simplices]
