"""Cylindrical joint: travel along e1 and angle about e1."""

from engine.joints.base import Axis, JointKind, about_e1, angle_about_e1

CYLINDRICAL = JointKind(
    "cylindrical",
    ((Axis(0, False),), (Axis(0, True),)),
    ("length", "angle"),
    lambda q, ops: about_e1(q[1], ops),
    lambda q: [q[0], 0.0, 0.0],
    (1, 2),
    ((1, 0), (2, 0)),
    lambda r, s, ops: [s[0], angle_about_e1(r, s, ops)],
    friction="shaft",
    contacts=2,
)
