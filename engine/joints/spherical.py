"""Spherical joint: a quaternion; its rates are the relative angular velocity in the inboard joint frame."""

from engine.joints.base import SPIN, JointKind, no_travel, of_quaternion, to_quaternion

SPHERICAL = JointKind(
    "spherical",
    SPIN,
    ("quaternion",) * 4,
    lambda q, ops: of_quaternion(q),
    no_travel,
    (0, 1, 2),
    (),
    lambda r, s, ops: to_quaternion(r, ops),
    friction="ball",
    contacts=1,
)
