"""Kinetic and potential energy."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import ENERGIES
from trunnion.columns.subjects import SYSTEM

KIND = ColumnKind(
    of=SYSTEM,
    operands={"energies": ENERGIES},
    quantities=(
        Quantity(name="kinetic", column="energy.kinetic", unit="J", text="kinetic energy"),
        Quantity(name="potential", at=1, column="energy.potential", unit="J", text="potential energy of gravity and springs"),
    ),
)
