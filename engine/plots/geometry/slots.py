"""Slots: two walls along a curve, and the pin between them. Internal cams: a wall around the follower."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from trunnion.plots.geometry.cams import mounted, outline
from trunnion.plots.geometry.gear_wheels import Wheel
from trunnion.plots.geometry.meshes import Mesh, cylinder, join
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import sides_of
from trunnion.system.construction.cam_profile_spline import closed
from trunnion.system.construction.point_curve_spline import along

STATIONS = 8
"""Corners of a wall between two points of a curve."""
PIN = 0.03
"""Radius of a drawn pin, divided by the extent of its curve."""
WALL, DEEP = 0.6, 5.0
"""WALL: thickness of a wall. DEEP: depth of a wall. Both are divided by the radius of a drawn pin."""


def slots(scene: sm.Scene) -> list[Wheel]:
    """The walls and pins of all curves, and the walls of internal cams."""
    out = []
    for name, j in scene.joints.items():
        if j.profile is not None and j.internal:
            path = outline(j)
            way = np.gradient(path, axis=0)
            wall = _wall(path, way / np.hypot(*way.T)[:, None], 0.0, PIN * float(np.ptp(path, axis=0).max()), closed(j.profile))
            out.append(Wheel(sides_of(scene, j)[0].body, name, mounted(sides_of(scene, j)[0], wall)))
        if j.curve is not None:
            a, b = sides_of(scene, j)
            path, way = along(j.curve, STATIONS)
            size = PIN * float(np.ptp(path, axis=0).max())
            r = float(j.roller or size)
            sides = (1.0, -1.0) if j.unilateral is None or j.slot is not None else (-1.0,)
            turned = [(path @ turn, way @ turn) for turn in _turns(j.slot.repeated if j.slot else 1)]
            walls = [_wall(*at, s * r, size, j.curve.closed) for at in turned for s in sides]
            out.append(Wheel(a.body, name, mounted(a, join(walls))))
            out.append(Wheel(b.body, name, mounted(b, cylinder(r, 1.3 * DEEP * size))))
    return out


def _turns(count: int) -> list[np.ndarray]:
    """The rotations of equal slots around e1 (2×2 each, to multiply row vectors from the right)."""
    angles = 2.0 * np.pi * np.arange(count) / count
    return [np.array([[np.cos(x), np.sin(x)], [-np.sin(x), np.cos(x)]]) for x in angles]


def _wall(path: np.ndarray, way: np.ndarray, off: float, size: float, closed: bool) -> Mesh:
    """A wall beside a path (n×2, y and z) with tangents ``way`` (n×2). The near side of the wall is at the distance ``off``, m, to
    the right of the path. size: radius of the pin, which determines the wall's thickness and depth."""
    right = np.column_stack([way[:, 1], -way[:, 0]])
    near, far, deep = path + off * right, path + (off + WALL * np.copysign(size, off)) * right, 0.5 * DEEP * size
    ring = [(near, -deep), (near, deep), (far, deep), (far, -deep)]
    if off < 0:
        ring.reverse()
    count = len(path)
    vertices = np.stack([np.column_stack([np.full(count, x), side]) for side, x in ring], axis=1).reshape(-1, 3)
    stations = [*pairwise(range(count)), *([(count - 1, 0)] if closed else [])]
    faces = [(4 * i + k, 4 * i + (k + 1) % 4, 4 * n + (k + 1) % 4, 4 * n + k) for i, n in stations for k in range(4)]
    edges = [0b1010] * len(faces)
    if not closed:
        last = 4 * (count - 1)
        faces += [(3, 2, 1, 0), (last, last + 1, last + 2, last + 3)]
        edges += [0b1111, 0b1111]
    return Mesh(vertices, tuple(faces), tuple(edges))
