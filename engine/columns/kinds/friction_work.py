"""Work of a joint's friction."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import WORK
from trunnion.columns.subjects import FRICTION_WORK

KIND = ColumnKind(
    of=FRICTION_WORK,
    operands={"work": WORK},
    quantities=(
        Quantity(name="quad", column="{joint}.friction.work", unit="J", integral=True,
                 text="work of friction in {joint} ({sense})"),
    ),
)  # fmt: skip
