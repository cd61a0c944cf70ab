"""Numbers with units in a scene's fields, and the types of these fields (``Length``, ``Mass``, …). Validation converts text such as
"45 deg" or "30 mm" to SI."""

from __future__ import annotations

import math
from numbers import Real
from typing import Annotated, Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.number_declarations import ANY, NOT_NEGATIVE, POSITIVE, Bound
from trunnion.scene.findings.name_suggestions import shown
from trunnion.scene.units.dimension_names import QUANTITIES, described, fits
from trunnion.scene.units.unit_parser import NONE, Dimension, UnitError, parse, parse_unit


class Quantity(float):
    """A float in SI that stores its original text and the dimension of the unit in that text."""

    __slots__ = ("dimension", "text")

    dimension: Dimension
    text: str

    def __new__(cls, value: float, dimension: Dimension, text: str) -> Quantity:
        self = super().__new__(cls, value)
        self.dimension, self.text = dimension, text
        return self

    def __getnewargs__(self) -> tuple[Any, ...]:  # type: ignore[override]
        return float(self), self.dimension, self.text

    def fits(self, wanted: Dimension) -> bool:
        """Whether this number is accepted where a number of dimension ``wanted`` is required."""
        return fits(self.dimension, wanted)


class Computed(Quantity):
    """The value of an expression. ``text`` is the expression with its braces; ``names`` are its parameters. ``plain``: whether the
    expression has neither parameters nor units; such an expression counts as a number without a unit."""

    __slots__ = ("names", "plain")

    names: frozenset[str]
    plain: bool

    def __new__(cls, value: float, dimension: Dimension, text: str, names: frozenset[str], plain: bool) -> Computed:
        self = float.__new__(cls, value)
        self.dimension, self.text, self.names, self.plain = dimension, text, names, plain
        return self

    def __getnewargs__(self) -> tuple[Any, ...]:  # type: ignore[override]
        return float(self), self.dimension, self.text, self.names, self.plain

    def fits(self, wanted: Dimension) -> bool:
        """Whether this number is accepted where a number of dimension ``wanted`` is required. Two rules are added to the rules
        of ``Quantity``. A ratio may be an angle (arc over radius). A radian next to other units is ignored (radius times angle is a
        length)."""
        given, rest = self.dimension, (*wanted[:3], wanted[4])
        if self.plain or given == wanted:
            return True
        return (*given[:3], given[4]) == rest and (rest != (0, 0, 0, 0) or given == NONE)


class NoValue(str):
    """The text of an invalid expression, with the cause ``what`` and the remedy ``hint``. For such a text, ``number`` raises
    UnitError with this cause and remedy."""

    __slots__ = ("hint", "what")

    what: str
    hint: str

    def __new__(cls, text: str, what: str, hint: str = "") -> NoValue:
        self = super().__new__(cls, text)
        self.what, self.hint = what, hint
        return self


def parse_quantity(text: str) -> float:
    """SI value of "VALUE" or "VALUE UNIT" (a Quantity when there is a unit). UnitError describes invalid text."""
    value, unit, _ = parse(text)
    return value if unit is None else Quantity(value, unit.dimension, text.strip())


def number(value: Any, wanted: str = "a number", example: str = "0.3") -> float:
    """A finite float (a Quantity for text with a unit) from a number or text. Raises UnitError for any other value; the error names
    the quantity ``wanted`` and gives an ``example``."""
    if isinstance(value, Quantity):
        return value
    if isinstance(value, NoValue):
        raise UnitError(value.what, value.hint)
    if isinstance(value, str):
        return parse_quantity(value)
    if isinstance(value, bool) or not isinstance(value, Real):
        raise UnitError(f"{wanted} is expected, not {shown(value)}", f"for example {example}")
    try:
        out = float(value)
    except OverflowError as e:
        raise UnitError(f"{shown(value)} is too large") from e
    if not math.isfinite(out):
        raise UnitError(f"{shown(value)} is not finite", f"for example {example}")
    return out


def agree(value: float, unit: str) -> None:
    """Raise UnitError when the dimension of a Quantity does not fit the SI unit ``unit``."""
    if not isinstance(value, Quantity):
        return
    wanted = parse_unit("" if unit == "1" else unit).dimension
    if not value.fits(wanted):
        name, example = QUANTITIES.get(unit, (described(wanted), f"1 {unit}"))
        raise UnitError(f"{shown(value.text)} is {described(value.dimension)}; {name} is expected", f'for example "{example}"')


@dataclass(frozen=True)
class AnyUnit:
    """Marks a number whose dimension depends on its context, for example on the freedom of the number. ``checks.number_bounds``
    checks dimension and ``bound`` in the complete scene, with the unit from ``queries.numbers_by_path``."""

    unit: str = ""
    bound: Bound = ANY

    def __call__(self, value: Any) -> float:
        """Validate a value as a number of any dimension."""
        return number(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(self)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return {"type": ["number", "string"]}


@dataclass(frozen=True)
class Per(AnyUnit):
    """Marks a number with the SI unit ``unit``. The field stores a plain float, or a ``Computed`` if parameters are involved."""

    def __call__(self, value: Any) -> float:
        """Validate a value and convert it to SI; raises UnitError when its dimension is not that of ``unit``."""
        if value.__class__ is float and math.isfinite(value):
            return value
        name, example = QUANTITIES[self.unit]
        out = number(value, name, f'"{example}"')
        agree(out, self.unit)
        return out if isinstance(out, Computed) and out.names else float(out)


Number = Annotated[float, AnyUnit()]
NotNegative = Annotated[float, AnyUnit(bound=NOT_NEGATIVE)]
Positive = Annotated[float, AnyUnit(bound=POSITIVE)]
Length = Annotated[float, Per("m")]
Extent = Annotated[float, Per("m", POSITIVE)]
Angle = Annotated[float, Per("rad")]
Time = Annotated[float, Per("s")]
Duration = Annotated[float, Per("s", POSITIVE)]
Acceleration = Annotated[float, Per("m/s^2")]
Mass = Annotated[float, Per("kg", NOT_NEGATIVE)]
Density = Annotated[float, Per("kg/m^3", POSITIVE)]
Inertia = Annotated[float, Per("kg*m^2")]
Stiffness = Annotated[float, Per("N/m", NOT_NEGATIVE)]
Damping = Annotated[float, Per("N*s/m", NOT_NEGATIVE)]
