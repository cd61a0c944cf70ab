"""Planar joint: travel along e2 and e3, angle about the normal e1."""

from trunnion.elements.joints.joint_kind import E1, E2, E3, JointKind, about_e1, angle_about_e1, slide, turn

PLANAR = JointKind(
    name="planar",
    freedoms="travel along e2, e3, angle about e1",
    axes=((slide(E2),), (slide(E3),), (turn(E1),)),
    coordinates=("length", "length", "angle"),
    rotation=lambda q, ops: about_e1(q[2], ops),
    travel=lambda q: [0.0, q[0], q[1]],
    rows_s=(0,),
    rows_r=((1, 0), (2, 0)),
    measure=lambda r, s, ops: [s[1], s[2], angle_about_e1(r, s, ops)],
)
