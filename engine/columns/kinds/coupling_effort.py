"""Effort of a coupling between the freedoms of two joints."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import COUPLING_MULTIPLIER
from trunnion.columns.subjects import TIE

KIND = ColumnKind(
    of=TIE,
    operands={"multiplier": COUPLING_MULTIPLIER},
    quantities=(
        Quantity(name="tie", column="{joint}.effort[1]", unit="{effort}", vector=False, direct=True,
                 text="effort of the coupling (mimic) on the outboard part, along the joint's freedom"),
    ),
)  # fmt: skip
