"""Free joint: three travels along the inboard axes and a quaternion, six freedoms in total. The joint transmits no reaction."""

from trunnion.elements.joints.joint_kind import E1, E2, E3, SPIN, JointKind, of_quaternion, slide, to_quaternion

FREE = JointKind(
    name="free",
    freedoms="travel along e1, e2, e3, quaternion",
    axes=(*((slide(k),) for k in (E1, E2, E3)), *SPIN),
    coordinates=("length", "length", "length", "quaternion", "quaternion", "quaternion", "quaternion"),
    rotation=lambda q, ops: of_quaternion(q[3:7]),
    travel=lambda q: list(q[:3]),
    measure=lambda r, s, ops: [*s, *to_quaternion(r, ops)],
)
