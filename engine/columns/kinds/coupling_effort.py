"""Effort of a coupling between the freedoms of two joints."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import COUPLING_MULTIPLIER
from trunnion.columns.subjects import TIE

KIND = ColumnKind(
    of=TIE,
    operands={"multiplier": COUPLING_MULTIPLIER},
    quantities=(
        Quantity(name="tie", column="{joint}.effort[1]", unit="{effort}", vector=False, direct=True,
                 text="what makes the freedom of a joint follow another's, on its outboard part"),
    ),
)  # fmt: skip
