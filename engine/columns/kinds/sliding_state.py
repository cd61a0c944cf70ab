"""Sliding state of a friction pair."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import PAIR_STATE
from trunnion.columns.subjects import PAIR

KIND = ColumnKind(
    of=PAIR,
    operands={"state": PAIR_STATE},
    quantities=(
        Quantity(name="state", column="{joint}.friction.state[{number}]", unit="1", vector=False, steps=True, smooth=False,
                 runtime=True,
                 text="sliding state: −1 or +1 slip, 0 proportional zone or stick (always 0 for laws without these states)"),
    ),
)  # fmt: skip
