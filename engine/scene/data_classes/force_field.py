"""A force field: a force on a point of a body that depends on the position of this point."""

from __future__ import annotations

from typing import Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.signals.position_formulas import separate
from trunnion.scene.units.numbers_with_units import Number


@validated(frozen=True, config=STRICT)
class PlaceFormula:
    """A smooth formula of the position x, y, z of a point in the world, such as "-2 N/m*x*exp(-(y/0.1 m)^2)", with numbers, units
    and parameters. In a scene, the text alone is enough."""

    formula: str
    """The formula. The names in it are x, y, z and parameters of the scene. Functions of the position: + - * / ^ sin cos exp log
    tanh atan sqrt."""
    numbers: tuple[Number, ...] = ()
    """The constant parts of the formula in their order, SI. Default: those of the formula."""

    __text_key__ = "formula"
    """A text instead of the group is this key's value."""
    __separate__ = staticmethod(separate)
    """Separates the constant parts of the formula."""


@validated(frozen=True, config=STRICT)
class Field:
    """A force on a point of a body by formulas of its position. It has no potential energy: its work counts as that of loads."""

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


COMPONENTS = ("fx", "fy", "fz")
"""Keys of the components of a field."""
