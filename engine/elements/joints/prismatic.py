"""Prismatic joint: travel along e1."""

from trunnion.elements.joints.joint_kind import E1, JointKind, slide

PRISMATIC = JointKind(
    name="prismatic",
    freedoms="travel along e1",
    axes=((slide(E1),),),
    coordinates=("length",),
    travel=lambda q: [q[0], 0.0, 0.0],
    rows_s=(1, 2),
    rows_r=((1, 0), (2, 0), (2, 1)),
    measure=lambda r, s, ops: [s[0]],
    friction="sleeve",
    contacts=5,
    loaded="loaded guide",
)
