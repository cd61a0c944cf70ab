"""Arguments of the public Python functions other than scenes (for scenes see ``overrides.scene_given``): numbers and times, also as
text ("10 ms"), and patterns of columns. Mistakes are collected, so that one error reports all mistakes."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Real

from trunnion.basics.errors import Problem, raise_problems
from trunnion.scene.units.numbers_with_units import Per
from trunnion.scene.units.unit_parser import UnitError

Amount = float | str
"""A number in SI, or text with a unit: 0.01, "10 ms"."""
Names = str | Iterable[str]
"""One pattern or path, or an iterable of them."""


def names_given(given: Names) -> tuple[str, ...]:
    """Patterns or paths as a tuple; a single text gives a tuple of length 1."""
    return (given,) if isinstance(given, str) else tuple(given)


class Amounts:
    """Reads the numeric arguments of a function and collects the mistakes; ``end`` raises all mistakes in one error."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def wanted(self, value: Amount | None, where: str) -> float | None:
        """A time in seconds; None stays None."""
        return None if value is None else self.time(value, where)

    def time(self, value: Amount, where: str) -> float:
        """A time in seconds."""
        return self.number(value, where, "s")

    def number(self, value: Amount, where: str, unit: str = "1") -> float:
        """SI value of a number or text. A number is returned unchanged (its bounds are checked elsewhere); text is converted from
        its unit. If the text is invalid, the mistake is collected and the result is 1."""
        if isinstance(value, Real) and not isinstance(value, bool):
            return float(value)
        try:
            return Per(unit)(value)
        except UnitError as e:
            self.problems.append(Problem(where, e.what, e.hint))
            return 1.0

    def end(self) -> None:
        """Raise SceneError with all collected mistakes; without mistakes, do nothing."""
        raise_problems(self.problems)
