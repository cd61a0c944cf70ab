"""Revolute joint: one angle about e1."""

from trunnion.elements.joints.joint_kind import E1, JointKind, about_e1, angle_about_e1, turn

REVOLUTE = JointKind(
    name="revolute",
    freedoms="angle about e1",
    axes=((turn(E1),),),
    coordinates=("angle",),
    rotation=lambda q, ops: about_e1(q[0], ops),
    rows_s=(0, 1, 2),
    rows_r=((1, 0), (2, 0)),
    measure=lambda r, s, ops: [angle_about_e1(r, s, ops)],
    friction="journal",
    contacts=2,
    loaded="loaded hinge",
    banded="band",
)
