"""Planar joint: travel along e2 and e3, angle about their normal e1."""

from engine.joints.base import Axis, JointKind, about_e1, angle_about_e1

PLANAR = JointKind(
    "planar",
    ((Axis(1, False),), (Axis(2, False),), (Axis(0, True),)),
    ("length", "length", "angle"),
    lambda q, ops: about_e1(q[2], ops),
    lambda q: [0.0, q[0], q[1]],
    (0,),
    ((1, 0), (2, 0)),
    lambda r, s, ops: [s[1], s[2], angle_about_e1(r, s, ops)],
)
