"""Rates of a joint's freedoms."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import RATE
from trunnion.columns.subjects import FREEDOM

KIND = ColumnKind(
    of=FREEDOM,
    operands={"rate": RATE},
    quantities=(
        Quantity(name="qd", column="{joint}.qd[{number}]", unit="{displacement}/s", text="rate {number} of {joint}", vector=False),
    ),
)
