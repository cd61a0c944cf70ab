"""What callers of the Python functions may give: for a time "10 ms"; for columns one pattern or several (for a scene see
``overrides.scene_given``). Every mistake is kept, so that all of them are told together."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Real

from engine.basics.problems import Problem, SceneError
from engine.scene.quantities import Per
from engine.scene.units import UnitError

Amount = float | str
"""A number in SI, or text with a unit: 0.01, "10 ms"."""
Names = str | Iterable[str]
"""One pattern or path, or several."""


def names_given(given: Names) -> tuple[str, ...]:
    """Patterns or paths as a tuple: a text is one of them, not its characters."""
    return (given,) if isinstance(given, str) else tuple(given)


class Amounts:
    """Reads the numbers a function was given. ``end`` tells what is wrong with any of them."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def wanted(self, value: Amount | None, where: str) -> float | None:
        """Seconds, or None where nothing is said."""
        return None if value is None else self.time(value, where)

    def time(self, value: Amount, where: str) -> float:
        """Seconds."""
        return self.number(value, where, "s")

    def number(self, value: Amount, where: str, unit: str = "1") -> float:
        """SI value; numbers are taken as they are (whether they fit is for others to say), text is read with its unit."""
        if isinstance(value, Real) and not isinstance(value, bool):
            return float(value)
        try:
            return Per(unit)(value)
        except UnitError as e:
            self.problems.append(Problem(where, e.what, e.hint))
            return 1.0

    def end(self) -> None:
        """SceneError with every mistake so far."""
        if self.problems:
            raise SceneError(self.problems)
