"""Loads that depend on the speed or the position of a body: drag, attraction by a point."""

from __future__ import annotations

from typing import Annotated, Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.number_declarations import NOT_NEGATIVE, POSITIVE
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.units.numbers_with_units import Density, Per


@validated(frozen=True, config=STRICT)
class Drag:
    """Drag in a medium at rest. The force ½ · density · coefficient · area · v² acts on a point, opposite to the point's velocity
    v."""

    type: Literal["drag"]
    """Kind of load: drag."""
    on: str
    """The point whose velocity counts: "body.point", or "body" for its mass centre."""
    area: Annotated[float, Per("m^2", NOT_NEGATIVE)]
    """Area to which the coefficient refers, usually the projection along the motion."""
    coefficient: Annotated[float, Per("1", NOT_NEGATIVE)]
    """Drag coefficient; it is constant."""
    density: Density
    """Density of the medium, such as 1.2 kg/m^3 for air."""


@validated(frozen=True, config=STRICT)
class PointGravity:
    """Attraction of a body's mass centre by a point: gm · mass / r², with the distance r. The opposite force acts on the point's
    body."""

    type: Literal["point_gravity"]
    """Kind of load: attraction by a point."""
    on: str
    """The body that is attracted."""
    towards: str
    """The attracting point: "body.point", or "body" for its frame origin."""
    gm: Annotated[float, Per("m^3/s^2", POSITIVE)]
    """Gravitational constant times the attracting mass."""
