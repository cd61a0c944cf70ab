"""Prismatic joint: travel along e1."""

from engine.joints.base import Axis, JointKind, identity

PRISMATIC = JointKind(
    "prismatic",
    ((Axis(0, False),),),
    ("length",),
    identity,
    lambda q: [q[0], 0.0, 0.0],
    (1, 2),
    ((1, 0), (2, 0), (2, 1)),
    lambda r, s, ops: [s[0]],
    friction="sleeve",
    contacts=5,
)
