"""Free joint: six freedoms, three travels along the inboard axes and a quaternion; its reaction is zero."""

from engine.joints.base import SPIN, Axis, JointKind, of_quaternion, to_quaternion

FREE = JointKind(
    "free",
    (*((Axis(k, False),) for k in range(3)), *SPIN),
    ("length",) * 3 + ("quaternion",) * 4,
    lambda q, ops: of_quaternion(q[3:7]),
    lambda q: list(q[:3]),
    (),
    (),
    lambda r, s, ops: [*s, *to_quaternion(r, ops)],
)
