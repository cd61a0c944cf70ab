"""Revolute joint: one angle about e1."""

from engine.joints.base import Axis, JointKind, about_e1, angle_about_e1, no_travel

REVOLUTE = JointKind(
    "revolute",
    ((Axis(0, True),),),
    ("angle",),
    lambda q, ops: about_e1(q[0], ops),
    no_travel,
    (0, 1, 2),
    ((1, 0), (2, 0)),
    lambda r, s, ops: [angle_about_e1(r, s, ops)],
    friction="journal",
    contacts=2,
)
