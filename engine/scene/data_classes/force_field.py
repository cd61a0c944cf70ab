"""A force field: a force on a point of a body that depends on the position of this point."""

from __future__ import annotations

from typing import Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.signals.position_formulas import separate
from trunnion.scene.units.numbers_with_units import Extent, Number


@validated(frozen=True, config=STRICT)
class PlaceFormula:
    """A smooth formula of the position x, y, z of a point in the world, such as "-2 N/m*x*exp(-(y/0.1 m)^2)", with numbers, units
    and parameters. In a scene, the text alone is enough."""

    formula: str
    """The formula. The names in it are x, y, z and parameters of the scene. Functions of the position: + - * / ^ sin cos exp log
    tanh atan sqrt."""
    numbers: tuple[Number, ...] = ()
    """Values of the constant parts of the formula, in their order, SI. Default: the values in the formula."""

    __text_key__ = "formula"
    """If a text is given instead of the group, the text is the value of this key."""
    __separate__ = staticmethod(separate)
    """Separates the constant parts of the formula."""


@validated(frozen=True, config=STRICT)
class Field:
    """A force on a point of a body by formulas of its position. The force has no potential energy: the work of the force counts as
    work of loads."""

    type: Literal["field"]
    """Kind of load: a force field."""
    on: str
    """The point: "body.point", or "body" for its mass centre."""
    fx: PlaceFormula | None = None
    """Component along the world's x, N; default: 0."""
    fy: PlaceFormula | None = None
    """Component along the world's y, N; default: 0."""
    fz: PlaceFormula | None = None
    """Component along the world's z, N; default: 0."""
    width: Extent | None = None
    """Width of the narrowest part of the field. Steps with error control move the point by at most half of this width. Default:
    steps are not limited; a note says so unless the formulas are polynomials."""


COMPONENTS = ("fx", "fy", "fz")
"""Keys of the components of a field."""
