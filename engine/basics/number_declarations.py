"""Declarations of numeric scene parameters: name, unit, allowed values. Scene files, overrides, sweeps, the service and FMUs use
the same declarations."""

from __future__ import annotations

import math
import re
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass

_NAME = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)
ZERO_BELOW = 1e-100
"""Values of smaller magnitude are printed and written as 0. (To avoid a division by zero, the norm of a zero vector is computed as
sqrt(1e-300) = 1e-150. Files show this norm as 0.)"""


@dataclass(frozen=True)
class Bound:
    """Allowed finite values, from ``least`` to ``most``. open: ``least`` is excluded. nonzero: 0 is excluded. advice: the remedy
    for a value that is not allowed."""

    least: float = -math.inf
    most: float = math.inf
    open: bool = False
    nonzero: bool = False
    advice: str = ""

    def __post_init__(self) -> None:
        if not self.least < self.most:
            raise ValueError(f"no number lies between {self.least:g} and {self.most:g}")

    def holds(self, value: float) -> bool:
        """Whether the bound allows a value."""
        above = value > self.least if self.open else value >= self.least
        return math.isfinite(value) and above and value <= self.most and not (self.nonzero and value == 0.0)

    @property
    def rule(self) -> str:
        """The bound in words: "must be positive", "must lie between 1e-14 and 0.1"."""
        if self.nonzero:
            return "must not be 0"
        if self.most < math.inf:
            both = self.least > -math.inf
            return f"must lie between {self.least:g} and {self.most:g}" if both else f"must not be above {self.most:g}"
        if self.least == 0.0:
            return "must be positive" if self.open else "must not be negative"
        if self.least > -math.inf:
            return f"must be above {self.least:g}" if self.open else f"must not be below {self.least:g}"
        return "must be a finite number"

    def refusal(self, name: str, value: float) -> str:
        """The message for a refused value."""
        return f"{name} {self.rule} (it is {value:g})"


ANY = Bound()
"""Every finite number."""
POSITIVE = Bound(0.0, open=True)
NOT_NEGATIVE = Bound(0.0)


@dataclass(frozen=True)
class Order:
    """Required order of two numbers of one law or contact element: ``high`` ≥ ``low``, or ``high`` > ``low`` if strict."""

    low: str
    high: str
    strict: bool = False

    def holds(self, low: float, high: float) -> bool:
        """Whether the two values are in order."""
        return low < high if self.strict else low <= high

    def refusal(self, low: float, high: float) -> str:
        """The message for two values in the wrong order."""
        rule, fault = ("be above", "not above") if self.strict else ("not be below", "below")
        return f"{self.high} must {rule} {self.low}: {high:g} is {fault} {low:g}"


@dataclass(frozen=True)
class Number:
    """A number of a friction law or contact element.

    name, unit   key in a scene, and SI unit ("1": dimensionless).
    text         description, as a phrase: "coefficient of sliding friction".
    bound        allowed values.
    example      a value as written in a scene.
    needed       whether the law or element always requires the number.
    needed_with  name of another number ("": no such rule). A scene with that number must give this number, too.
    derived      whether the scene's geometry determines the number if the scene does not give it.
    default      value for joints that do not give the number (the scene's ``friction`` group then has this key too).
    not_below    name of another number of the same law or element, which is the lower limit of this number ("": no such limit).
    count        number of values. A cross has two journals: a scene gives one value for both, or a list.
    symbol       symbol in formulas, if it differs from the name.
    varies       whether the number may be a function of time or of an input.
    by_speed     whether the number may be a function of the sliding speed.
    by_load      whether the number may be a function of the load, or of the speed (an efficiency)."""

    name: str
    unit: str
    text: str
    bound: Bound = ANY
    example: str = "0.3"
    needed: bool = True
    needed_with: str = ""
    default: float | None = None
    not_below: str = ""
    count: int = 1
    symbol: str = ""
    varies: bool = False
    by_speed: bool = False
    by_load: bool = False
    derived: bool = False

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ValueError(f"{self.name!r} cannot be the name of a number: small letters, digits and _")
        if not self.text:
            raise ValueError(f"number {self.name} has no description")
        if self.default is not None and not self.bound.holds(self.default):
            raise ValueError(f"number {self.name}: its default {self.default:g} {self.bound.rule}")
        if self.count < 1:
            raise ValueError(f"number {self.name}: its count {self.count} must be at least 1")

    @property
    def order(self) -> Order | None:
        """The order of two numbers that ``not_below`` requires; None if ``not_below`` is empty."""
        return Order(self.not_below, self.name) if self.not_below else None

    @property
    def labels(self) -> tuple[str, ...]:
        """The name, or ``radius[1]``, ``radius[2]``, … if ``count`` is above 1."""
        return (self.name,) if self.count == 1 else tuple(f"{self.name}[{k + 1}]" for k in range(self.count))

    @property
    def hint(self) -> str:
        """The hint for a missing or wrong value."""
        return f"for example {self.name}: {self.example}"


def checked_numbers(owner: str, numbers: Any) -> None:
    """Check the numbers of one owner, such as "law lugre". Raises ValueError for inconsistent numbers."""
    if not isinstance(numbers, tuple) or not all(isinstance(n, Number) for n in numbers):
        raise ValueError(f"{owner}: its numbers are a tuple of Number(name, unit, text, …)")
    names = [n.name for n in numbers]
    for n in numbers:
        if names.count(n.name) > 1:
            raise ValueError(f"{owner}: two numbers are called {n.name}")
        for other in (n.needed_with, n.not_below):
            if other and other not in names:
                raise ValueError(f"{owner}: {n.name} refers to {other}, which is not one of its numbers")
        if n.needed and n.needed_with:
            raise ValueError(f"{owner}: {n.name} is either always needed, or needed with {n.needed_with}, but not both")


def merged(owners: dict[str, tuple[Number, ...]]) -> dict[str, tuple[Number, tuple[str, ...]]]:
    """The numbers of several owners by name, each with its owners. Raises ValueError if two owners declare a name differently."""
    out: dict[str, tuple[Number, tuple[str, ...]]] = {}
    for owner, numbers in owners.items():
        for n in numbers:
            first, who = out.get(n.name, (n, ()))
            for what in ("unit", "bound", "default", "not_below"):
                if getattr(first, what) != getattr(n, what):
                    raise ValueError(f"number {n.name} has another {what} in {owner} than in {who[0]}")
            out[n.name] = (first, (*who, owner))
    return out
