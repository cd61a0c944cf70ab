"""Lengths of parts along a joint's axis."""

from __future__ import annotations

import math

from trunnion.scene.data_classes.scene import Body, Scene
from trunnion.scene.queries.body_poses_and_joint_sides import JointSide, vector
from trunnion.scene.queries.body_references import GROUND


def extent(scene: Scene, side: JointSide) -> float:
    """Length of a part along the joint's axis, m; infinite for the ground and for a part without a shape."""
    if side.body == GROUND or side.axis is None:
        return math.inf
    return _length(scene.bodies[side.body], vector(side.axis))


def _length(b: Body, axis: tuple[float, float, float]) -> float:
    """Length of a body's shape along an axis, m; infinite without a shape."""
    size = math.hypot(*axis)
    if b.box is not None:
        return sum(abs(a) * float(e) for a, e in zip(axis, b.box, strict=True)) / size
    if b.cylinder is not None:
        along = abs(axis["xyz".index(b.cylinder.axis[-1])]) / size
        return along * float(b.cylinder.length) + 2.0 * math.sqrt(max(0.0, 1.0 - along**2)) * float(b.cylinder.radius)
    return math.inf if b.sphere is None else 2.0 * float(b.sphere)
