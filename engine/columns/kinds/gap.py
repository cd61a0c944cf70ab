"""Gap of a joint whose contact can only push, such as a cam and its follower."""

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
