"""Orientation of a body as a quaternion."""

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import BODY_MOTION, Motion
from trunnion.columns.subjects import BODY


def orientation(motion: Motion) -> dict[str, list[SX]]:
    """The quaternion of R, scalar first."""
    from trunnion.elements.joints.joint_kind import to_quaternion

    return {"orientation": to_quaternion([[motion.R[i, k] for k in range(3)] for i in range(3)], ca)}


KIND = ColumnKind(
    of=BODY,
    operands={"motion": BODY_MOTION},
    expression=orientation,
    quantities=(
        Quantity(name="orientation", output="orientation", column="{body}.orientation[{component}]", size=4, unit="1",
                 text="orientation of {body}, quaternion, scalar first"),
    ),
)  # fmt: skip
