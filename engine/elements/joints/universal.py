"""Universal joint: an angle about u1 (inboard e1), then an angle about u2 (outboard e2)."""

from trunnion.elements.joints.joint_kind import E1, E2, JointKind, turn


def _rotation(q, ops):
    """R as a product of two rotations: by q1 about e1, then by q2 about the rotated e2."""
    c1, s1, c2, s2 = ops.cos(q[0]), ops.sin(q[0]), ops.cos(q[1]), ops.sin(q[1])
    return [[c2, 0.0, s2], [s1 * s2, c1, -s1 * c2], [-c1 * s2, s1, c1 * c2]]


UNIVERSAL = JointKind(
    name="universal",
    freedoms="angle about u1 = inboard e1, about u2 = outboard e2",
    axes=((turn(E1),), (turn(E2, "out"),)),
    coordinates=("angle", "angle"),
    rotation=_rotation,
    rows_s=(0, 1, 2),
    rows_r=((0, 1),),
    measure=lambda r, s, ops: [ops.atan2(r[2][1], r[1][1]), ops.atan2(r[0][2], r[0][0])],
    friction="cross",
    contacts=4,
)
