"""Accelerations of a joint's freedoms."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import JOINT_ACCELERATION
from trunnion.columns.subjects import FREEDOM

KIND = ColumnKind(
    of=FREEDOM,
    operands={"acceleration": JOINT_ACCELERATION},
    quantities=(
        Quantity(name="qdd", column="{joint}.qdd[{number}]", unit="{displacement}/s^2", text="acceleration {number} of {joint}",
                 vector=False, direct=True),
    ),
)  # fmt: skip
