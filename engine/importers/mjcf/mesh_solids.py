"""Volume and inertia of MJCF meshes by the methods of MuJoCo."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.importers.pose_matrices import Pose

WAYS = ("legacy", "exact", "convex")
"""Supported methods for the volume and inertia of a mesh (MJCF attribute ``inertia``)."""


@dataclass
class MassProperties:
    """Mass, mass centre (3), and inertia about the mass centre (3×3)."""

    mass: float = 0.0
    center: np.ndarray = field(default_factory=lambda: np.zeros(3))
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))

    def placed(self, at: Pose) -> MassProperties:
        """These mass properties, expressed in another frame. ``at`` is the pose of the present frame in that frame."""
        R = at[:3, :3]
        return MassProperties(self.mass, at[:3, 3] + R @ self.center, R @ self.inertia @ R.T)


def solid(corners: np.ndarray, way: str) -> MassProperties:
    """The solid of density 1 inside triangles (n×3×3). The method ``way`` is one of:

    exact   signed volumes of tetrahedra
    legacy  absolute volumes of tetrahedra with their apex at the surface's centroid
    convex  the convex hull
    """
    if way == "convex":
        corners, way = hull(corners.reshape(-1, 3)), "legacy"
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(one, two)
    area = np.linalg.norm(normal, axis=1)
    apex = (area[:, None] * corners.mean(axis=1)).sum(axis=0) / area.sum() if way == "legacy" else np.zeros(3)
    parts = _volumes(corners - apex, way)
    center = apex + (parts[:, None] * (corners - apex).sum(axis=1) / 4).sum(axis=0) / parts.sum()
    arms = corners - center  # the legacy method repeats the computation with this centre as apex, which changes the volume
    parts, total = _volumes(arms, way), arms.sum(axis=1)
    second = (np.einsum("nki,nkj,n->ij", arms, arms, parts) + np.einsum("ni,nj,n->ij", total, total, parts)) / 20
    return MassProperties(float(parts.sum()), center, np.trace(second) * np.eye(3) - second)


def _volumes(corners: np.ndarray, way: str) -> np.ndarray:
    """Signed volumes (n) of the tetrahedra formed by the triangles (n×3×3) and the origin. The legacy method has absolute
    values."""
    parts = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    return np.abs(parts) if way == "legacy" else parts


def hull(points: np.ndarray) -> np.ndarray:
    """The triangles (n×3×3) of the convex hull of points (n×3)."""
    from trunnion.basics.optional_packages import brought

    spatial = brought("scipy.spatial", "analysis", "the convex hull of a mesh")
    return points[spatial.ConvexHull(points).simplices]
