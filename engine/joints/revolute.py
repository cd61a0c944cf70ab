"""Revolute joint: one angle about e1."""

from engine.joints.base import E1, JointKind, about_e1, angle_about_e1, no_travel, turn

REVOLUTE = JointKind(
    name="revolute",
    freedoms="angle about e1",
    axes=((turn(E1),),),
    coordinates=("angle",),
    rotation=lambda q, ops: about_e1(q[0], ops),
    travel=no_travel,
    rows_s=(0, 1, 2),
    rows_r=((1, 0), (2, 0)),
    measure=lambda r, s, ops: [angle_about_e1(r, s, ops)],
    friction="journal",
    contacts=2,
)
