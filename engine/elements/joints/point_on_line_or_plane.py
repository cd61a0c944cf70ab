"""A point of one part on a line or a plane of the other part: a pin in a slot, a ball on a table. The rotation is free."""

from trunnion.elements.joints.joint_kind import E1, E2, E3, SPIN, JointKind, of_quaternion, slide, to_quaternion

POINT_ON_LINE = JointKind(
    name="point_on_line",
    freedoms="travel along e1, quaternion",
    axes=((slide(E1),), *SPIN),
    coordinates=("length", "quaternion", "quaternion", "quaternion", "quaternion"),
    rotation=lambda q, ops: of_quaternion(q[1:5]),
    travel=lambda q: [q[0], 0.0, 0.0],
    rows_s=(1, 2),
    measure=lambda r, s, ops: [s[0], *to_quaternion(r, ops)],
)

POINT_ON_PLANE = JointKind(
    name="point_on_plane",
    freedoms="travel along e2, e3, quaternion",
    axes=((slide(E2),), (slide(E3),), *SPIN),
    coordinates=("length", "length", "quaternion", "quaternion", "quaternion", "quaternion"),
    rotation=lambda q, ops: of_quaternion(q[2:6]),
    travel=lambda q: [0.0, q[0], q[1]],
    rows_s=(0,),
    measure=lambda r, s, ops: [s[1], s[2], *to_quaternion(r, ops)],
    friction="point_contact",
    contacts=1,
)
