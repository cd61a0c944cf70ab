"""What a number of a scene is: its name, its unit, and the values it may have. These are written once, where the number
belongs, and hold everywhere: in scene files, overrides, sweeps, the service and FMUs."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

_NAME = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)


@dataclass(frozen=True)
class Bound:
    """The values a number may have: finite ones from ``least`` to ``most``. ``open``: ``least`` itself is excluded;
    ``nonzero``: zero is excluded. advice: what to do instead of giving a value outside."""

    least: float = -math.inf
    most: float = math.inf
    open: bool = False
    nonzero: bool = False
    advice: str = ""

    def __post_init__(self) -> None:
        if not self.least < self.most:
            raise ValueError(f"no number lies between {self.least:g} and {self.most:g}")

    @property
    def free(self) -> bool:
        """Whether every finite number is allowed."""
        return self.least == -math.inf and self.most == math.inf and not self.nonzero

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
        """Why a value is refused, in the same words everywhere."""
        return f"{name} {self.rule} (it is {value:g})"


ANY = Bound()
"""Every finite number."""
POSITIVE = Bound(0.0, open=True)
NOT_NEGATIVE = Bound(0.0)


@dataclass(frozen=True)
class Order:
    """Two numbers of one owner: ``high`` must not be below ``low`` (strict: must be above)."""

    low: str
    high: str
    strict: bool = False

    def holds(self, low: float, high: float) -> bool:
        """Whether the two values are in order."""
        return low < high if self.strict else low <= high

    def refusal(self, low: float, high: float) -> str:
        """Why two values are refused, in the same words everywhere."""
        rule, fault = ("be above", "not above") if self.strict else ("not be below", "below")
        return f"{self.high} must {rule} {self.low}: {high:g} is {fault} {low:g}"


@dataclass(frozen=True)
class Number:
    """A number of a friction law or contact element, as its file declares it.

    name, unit   its key in a scene, and its SI unit ("1" for none).
    text         what it is, as a phrase: "coefficient of sliding friction".
    bound        the values it may have.
    example      what it could be, as written in a scene.
    needed       whether there is no law (element) without it; needed_with: the number beside which it is needed.
    default      value a scene uses for every joint that gives none (then the scene's ``friction`` group has this key too).
    not_below    another number of the same owner below which it must not be.
    count        how many there are (a cross has two journals: one number for both, or a list).
    symbol       its letter in formulas, where that is not its name.
    varies       whether it may follow time or an input; by_speed: whether it may follow the sliding speed.
    """

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

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ValueError(f"{self.name!r} cannot be the name of a number: small letters, digits and _")
        if not self.text:
            raise ValueError(f"number {self.name} does not say what it is")
        if self.default is not None and not self.bound.holds(self.default):
            raise ValueError(f"number {self.name}: its default {self.default:g} {self.bound.rule}")
        if self.count < 1:
            raise ValueError(f"number {self.name}: there cannot be {self.count} of it")

    @property
    def order(self) -> Order | None:
        """The comparison that ``not_below`` stands for; None without it."""
        return Order(self.not_below, self.name) if self.not_below else None

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of its entries: its own name, or ``radius[1]``, ``radius[2]``, … when there are several."""
        return (self.name,) if self.count == 1 else tuple(f"{self.name}[{k + 1}]" for k in range(self.count))

    @property
    def hint(self) -> str:
        """The hint for a user who gives none, or a wrong one."""
        return f"for example {self.name}: {self.example}"


def checked_numbers(owner: str, numbers: Any) -> None:
    """ValueError when the numbers declared by an owner ("law lugre") do not fit together."""
    if not isinstance(numbers, tuple) or not all(isinstance(n, Number) for n in numbers):
        raise ValueError(f"{owner}: its numbers are a tuple of Number(name, unit, text, …)")
    names = [n.name for n in numbers]
    for n in numbers:
        if names.count(n.name) > 1:
            raise ValueError(f"{owner}: two numbers are called {n.name}")
        for other in (n.needed_with, n.not_below):
            if other and other not in names:
                raise ValueError(f"{owner}: {n.name} refers to {other}, which is none of its numbers")
        if n.needed and n.needed_with:
            raise ValueError(f"{owner}: {n.name} is needed always, or with {n.needed_with}: not both")


def merged(owners: dict[str, tuple[Number, ...]]) -> dict[str, tuple[Number, tuple[str, ...]]]:
    """Numbers of several owners by name, each with the owners that have it. ValueError when two of them mean different things by
    one name."""
    out: dict[str, tuple[Number, tuple[str, ...]]] = {}
    for owner, numbers in owners.items():
        for n in numbers:
            first, who = out.get(n.name, (n, ()))
            for what in ("unit", "bound", "default", "not_below"):
                if getattr(first, what) != getattr(n, what):
                    raise ValueError(f"number {n.name} has another {what} in {owner} than in {who[0]}")
            out[n.name] = (first, (*who, owner))
    return out
