"""Friction along a joint's freedoms."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import FRICTION_MULTIPLIER
from trunnion.columns.subjects import FRICTION_FREEDOM

KIND = ColumnKind(
    of=FRICTION_FREEDOM,
    operands={"eta": FRICTION_MULTIPLIER},
    quantities=(
        Quantity(name="friction", column="{joint}.friction.{place}", unit="{effort}",
                 text="friction {what} of {joint} on the inboard part", direct=True),
    ),
)  # fmt: skip
