"""Screw joint: one angle about e1 that travels pitch/2π along e1. It has no rows of the form (46), (49): not to be cut."""

from engine.joints.base import Axis, JointKind, about_e1, angle_about_e1

SCREW = JointKind(
    "screw",
    ((Axis(0, True), Axis(0, False, by_pitch=True)),),
    ("angle",),
    lambda q, ops: about_e1(q[0], ops),
    lambda q: [q[0], 0.0, 0.0],
    (),
    (),
    lambda r, s, ops: [angle_about_e1(r, s, ops)],
    cuttable=False,
)
