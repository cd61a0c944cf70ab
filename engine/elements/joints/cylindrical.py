"""Cylindrical joint: travel along e1 and angle about e1."""

from trunnion.elements.joints.joint_kind import E1, JointKind, about_e1, angle_about_e1, slide, turn

CYLINDRICAL = JointKind(
    name="cylindrical",
    freedoms="travel along e1, angle about e1",
    axes=((slide(E1),), (turn(E1),)),
    coordinates=("length", "angle"),
    rotation=lambda q, ops: about_e1(q[1], ops),
    travel=lambda q: [q[0], 0.0, 0.0],
    rows_s=(1, 2),
    rows_r=((1, 0), (2, 0)),
    measure=lambda r, s, ops: [s[0], angle_about_e1(r, s, ops)],
    friction="shaft",
    contacts=2,
)
