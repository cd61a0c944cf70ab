"""Screw joint: an angle about e1, and a travel along e1 of pitch/2π times the angle. A screw is never cut, because no row of the
form (46) or (49) couples travel and angle."""

from trunnion.elements.joints.joint_kind import E1, JointKind, about_e1, angle_about_e1, slide, turn

SCREW = JointKind(
    name="screw",
    freedoms="angle about e1; travel = pitch * turns",
    axes=((turn(E1), slide(E1, by_pitch=True)),),
    coordinates=("angle",),
    rotation=lambda q, ops: about_e1(q[0], ops),
    travel=lambda q: [q[0], 0.0, 0.0],
    rows_s=(1, 2),
    rows_r=((1, 0), (2, 0)),
    ties=1,
    measure=lambda r, s, ops: [angle_about_e1(r, s, ops)],
    friction="thread",
    contacts=1,
)
