"""A smooth formula of the time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from trunnion.basics.lazy_casadi import SX
from trunnion.basics.lazy_data_classes import validated
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.signals.declaration import SignalKind, Triple, sampled_times
from trunnion.scene.signals.time_formulas import computed, operate, rates_of_angles, separate
from trunnion.scene.units.dimension_names import unit_of
from trunnion.scene.units.numbers_with_units import Number, Quantity
from trunnion.scene.units.unit_parser import UnitError


@validated(frozen=True, config=STRICT)
class Expression:
    """A smooth formula of the time t, such as "2 N*sin(2*pi*3 Hz*t)*exp(-t/0.5 s)", with numbers, units and parameters. In a scene,
    the text alone is enough: ``expression: "…"``."""

    formula: str
    """The formula. The names in it are parameters of the scene; t is the time. Functions of the time: + - * / ^ sin cos exp log
    tanh atan sqrt."""
    numbers: tuple[Number, ...] = ()
    """Values of the constant parts of the formula, in their order, SI. Default: the values in the formula."""

    __text_key__ = "formula"
    """If a text is given instead of the group, the text is the value of this key."""
    __separate__ = staticmethod(separate)
    """Separates the constant parts of the formula."""


class ExpressionKind(SignalKind):
    """Leaves of the signal: the constant parts of the formula. ``formula`` of the signal is the tree of the remaining parts."""

    key, data, text = "expression", Expression, "Smooth formula of the time t."

    def signal(self, data: Expression, put: Any) -> Any:
        tree, _ = separate(data.formula)
        units = [(unit_of(n.dimension) if isinstance(n, Quantity) else "") or "1" for n in data.numbers]
        leaves = [put.own(f"numbers[{i + 1}]", n, unit) for i, (n, unit) in enumerate(zip(data.numbers, units, strict=True))]
        return put.signal("expression", *leaves, formula=tree)

    def load(self, sym: Any, s: Any) -> SX:
        return self._computed(sym, s, 1)[0]

    def motion(self, sym: Any, s: Any) -> Triple:
        place, rate, acceleration = self._computed(sym, s, 3)
        return place, rate, acceleration

    def _computed(self, sym: Any, s: Any, order: int) -> Sequence[SX]:
        return computed(
            s.formula, lambda i: [sym.leaf(s.leaves[i]), 0 * sym.t, 0 * sym.t][:order],
            lambda: [sym.t, 1 + 0 * sym.t, 0 * sym.t][:order], operate,
        )

    def paces(self, s: Any, turns: bool) -> Iterator[tuple[Any, float]]:
        yield from ((s.leaves[i], 0.5 / math.pi) for i in rates_of_angles(s.formula))

    def unlimited(self, data: Expression) -> str:
        return "an expression"

    def findings(self, path: Path, data: Expression, drive: bool) -> Iterator[Finding]:
        at: Path = (*path, "formula")
        try:
            wanted = len(separate(data.formula)[1])
        except UnitError as e:
            yield Finding(at, e.what, e.hint)
            return
        if wanted != len(data.numbers):
            yield Finding((*path, "numbers"), f"the formula has {wanted} constant parts, not {len(data.numbers)}", "omit numbers")
            return
        if not math.isfinite(self.value(data, 0.0)):
            yield Finding(at, "this formula has no value at t = 0", "shift it, for example t + 1 s")

    def values(self, data: Expression, until: float) -> Mapping[str, Sequence[float]]:
        found = [self.value(data, t) for t in sampled_times(until)]
        return {"formula": [x for x in found if math.isfinite(x)]}

    def value(self, data: Expression, t: float) -> float:
        try:
            return float(computed(separate(data.formula)[0], lambda i: float(data.numbers[i]), lambda: t, _plain))
        except (ArithmeticError, ValueError, IndexError, UnitError):
            return math.nan

    def coordinate(self, data: Expression, t: float) -> float:
        return self.value(data, t)


def _plain(operation: str, *given: float) -> float:
    """The result of an operation on numbers."""
    a, b = given[0], given[-1]
    simple = {"+": a + b, "-": a - b, "*": a * b, "neg": -a, "square": a * a}
    if operation in simple:
        return simple[operation]
    if operation in ("/", "inverse"):
        return a / b if operation == "/" else 1.0 / a
    return float(getattr(math, operation)(a))
