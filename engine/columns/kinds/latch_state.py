"""Number of the tooth that holds the hook of a latch."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import LATCH_HOOK
from trunnion.columns.subjects import LATCH

KIND = ColumnKind(
    of=LATCH,
    operands={"hook": LATCH_HOOK},
    quantities=(
        Quantity(name="latched", column="{joint}.latch.state[{number}]", unit="1",
                 text="tooth that the hook of {joint} is on, from 1 (0: hook up)", vector=False, steps=True, smooth=False),
    ),
)  # fmt: skip
