"""Slots: two walls along a curve, and the pin between them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from trunnion.plots.geometry.cams import mounted
from trunnion.plots.geometry.gear_wheels import Wheel
from trunnion.plots.geometry.meshes import Mesh, cylinder, join
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses import sides_of
from trunnion.system.construction.point_curve_spline import along

STATIONS = 8
"""Corners of a wall between two points of a curve."""
PIN = 0.03
"""Radius of a drawn pin, divided by the extent of its curve."""
WALL, DEEP = 0.6, 5.0
"""Thickness and depth of a wall, divided by the radius of the pin."""


def slots(scene: sm.Scene) -> list[Wheel]:
    """The walls and pins of all curves."""
    out = []
    for name, j in scene.joints.items():
        if j.curve is not None:
            a, b = sides_of(scene, j)
            path, way = along(j.curve, STATIONS)
            r = PIN * float(np.ptp(path, axis=0).max())
            out.append(Wheel(a.body, name, mounted(a, join([_wall(path, way, s * r, j.curve.closed) for s in (1.0, -1.0)]))))
            out.append(Wheel(b.body, name, mounted(b, cylinder(r, 1.3 * DEEP * r))))
    return out


def _wall(path: np.ndarray, way: np.ndarray, off: float, closed: bool) -> Mesh:
    """A wall beside a path (n×2, y and z) with tangents ``way`` (n×2). Its near side is ``off`` to the right of the path."""
    right = np.column_stack([way[:, 1], -way[:, 0]])
    near, far, deep = path + off * right, path + (1 + WALL) * off * right, 0.5 * DEEP * abs(off)
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
