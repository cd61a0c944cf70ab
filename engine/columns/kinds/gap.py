"""Gap of a joint that only pushes."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import GAP
from trunnion.columns.subjects import UNILATERAL

KIND = ColumnKind(
    of=UNILATERAL,
    operands={"gap": GAP},
    quantities=(
        Quantity(name="gap", column="{joint}.gap", unit="m", text="gap of {joint}, 0 while the contact is closed", vector=False),
    ),
)  # fmt: skip
