"""Tensions at both ends of a band, or in both strands of a belt."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import FRICTION, FRICTION_MULTIPLIER
from trunnion.columns.subjects import BANDED

if TYPE_CHECKING:
    from trunnion.recursion.complement_equation_terms import FrictionTerms


def tensions(friction: FrictionTerms, eta: SX) -> dict[str, list[SX]]:
    """The tensions, computed from the friction at the surface."""
    found = friction.element.contact.tensions
    assert found is not None
    return {"tension": found(eta, friction.numbers)}


KIND = ColumnKind(
    of=BANDED,
    operands={"friction": FRICTION, "eta": FRICTION_MULTIPLIER},
    expression=tensions,
    quantities=(
        Quantity(name="tension", output="tension", column="{joint}.tension[{component}]", size=2, unit="N",
                 text="tension of the band of {joint}: first at the end with the given tension, then at the other end",
                 direct=True, vector=False),
    ),
)  # fmt: skip
