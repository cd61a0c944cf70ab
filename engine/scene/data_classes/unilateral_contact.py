"""A joint that only pushes: contact that begins and ends."""

from __future__ import annotations

from typing import Annotated, Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import Bound
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.units.numbers_with_units import Extent, Per

RESTITUTION = Bound(0.0, 0.999, advice="0: the parts do not bounce; 0.999: they hardly lose speed")


@validated(frozen=True, config=STRICT)
class Unilateral:
    """A joint whose constraint only pushes. The contact opens where the normal force would pull, and closes again with an impact
    where the gap becomes 0. The outboard part is free on the side towards which the normal of the joint points."""

    restitution: Annotated[float, Per("1", RESTITUTION)] = 0.0
    """Coefficient of restitution of impacts."""
    impact_law: Literal["newton", "poisson"] = "newton"
    """newton: the parts separate with ``restitution`` times the speed of approach. poisson: the impulse of the restitution phase is
    ``restitution`` times the impulse of the compression phase. All joints of a scene have the same law."""
    starts: Literal["touching", "open"] = "touching"
    """touching: the loop is closed at the start. open: the contact starts with the gap that the start values give."""
    thickness: Extent | None = None
    """Thickness of a wall that ends where its open curve ends, or where its profile of less than a turn ends. The outboard part can
    leave the wall at this end and return, or pass behind the wall. Default: the wall continues straight, and without end."""
