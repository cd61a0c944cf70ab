"""Deflection of the bristles, for friction laws with a state."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import BRISTLE_SCALE, BRISTLE_STATE
from trunnion.columns.subjects import BRISTLES


def deflection(state: SX, scale: SX) -> dict[str, SX]:
    """Deflection z = state / scale. The state of a bristle is the friction ratio σ0 z, and the scale is σ0."""
    return {"deflection": state / scale}


KIND = ColumnKind(
    of=BRISTLES,
    operands={"state": BRISTLE_STATE, "scale": BRISTLE_SCALE},
    expression=deflection,
    quantities=(
        Quantity(name="bristle", output="deflection", column="{joint}.friction.bristle[{number}]", unit="m",
                 text="deflection of the bristles of {joint} along freedom {number}{radius}"),
    ),
)  # fmt: skip
