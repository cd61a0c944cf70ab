"""What callers may give to the Python functions besides a scene: a time as text ("10 ms"), one pattern of columns or several
(for a scene see ``overrides.scene_given``). Mistakes are collected, so that all of them are told together."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Real

from trunnion.basics.problems import Problem, SceneError
from trunnion.scene.units.quantities import Per
from trunnion.scene.units.unit_parser import UnitError

Amount = float | str
"""A number in SI, or text with a unit: 0.01, "10 ms"."""
Names = str | Iterable[str]
"""One pattern or path, or several."""


def names_given(given: Names) -> tuple[str, ...]:
    """One pattern or path, or several, as a tuple; a text is one of them, not a sequence of characters."""
    return (given,) if isinstance(given, str) else tuple(given)


class Amounts:
    """Reads the numbers a function was given and collects what is wrong with them; ``end`` raises it."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def wanted(self, value: Amount | None, where: str) -> float | None:
        """A time in seconds; None where none is given."""
        return None if value is None else self.time(value, where)

    def time(self, value: Amount, where: str) -> float:
        """A time in seconds."""
        return self.number(value, where, "s")

    def number(self, value: Amount, where: str, unit: str = "1") -> float:
        """SI value of a number or text. Numbers are taken as they are (their bounds are checked elsewhere); text is read with
        its unit."""
        if isinstance(value, Real) and not isinstance(value, bool):
            return float(value)
        try:
            return Per(unit)(value)
        except UnitError as e:
            self.problems.append(Problem(where, e.what, e.hint))
            return 1.0

    def end(self) -> None:
        """Raise SceneError with every mistake so far, if there is any."""
        if self.problems:
            raise SceneError(self.problems)
