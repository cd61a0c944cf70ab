"""What is stated about the error of a run: its size in every column and row, in the times of events, and how long that holds."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf
from typing import Any

import numpy as np

REASONS = {
    "": "",
    "events": "a run at a tighter tolerance decides otherwise there",
    "marginal": "an event there is decided by less than the run's own error",
    "growth": "errors have grown there until they are no longer small",
    "outcome": "a run at a tighter tolerance ends otherwise",
    "cost": "a tighter run comes to cost more than half as much again up to there",
    "stopped": "the tighter run was stopped there",
    "start": "the run was stopped, or could not start",
}
"""Why nothing is promised from some time on, in words."""


def rough(error: float) -> str:
    """An error as text, in the one digit that means something."""
    return f"{float(f'{error:.1g}'):g}"


@dataclass(frozen=True)
class Promise:
    """How long the stated errors hold. until: time from which nothing is promised, s (infinity: they hold to the end); why: a
    word of ``REASONS`` ("" where they hold to the end); about: what happens there, in words; doubling: time in which errors
    double where they grow steadily, s (infinity: they do not)."""

    until: float = inf
    why: str = ""
    about: str = ""
    doubling: float = inf

    @property
    def whole(self) -> bool:
        """Whether it holds to the end of the run."""
        return not self.why

    def __str__(self) -> str:
        if self.whole:
            return "to the end of the run"
        return f"nothing is promised from t = {self.until:.6g} s: {REASONS[self.why]}" + (f" ({self.about})" if self.about else "")


@dataclass(frozen=True)
class Certainty:
    """The global error of a run, of integration and of round-off.

    names, units: of the columns, without time. error: of each column in each row, in its unit: the largest estimated up to
    then (not a number where nothing is promised, and for columns without an error, such as ``audit.*``). shift: of each row,
    s: not 0 where an event may have come earlier or later by so much: columns that jump are there before their jump or behind
    it. event_errors: of the time of each event, s. floor: what each column's error cannot be told below, in its unit. rtol,
    method: of the tighter run; cost: evaluations of both runs over those of the first. asked: the accuracy that was asked for
    ("": none); met: whether all errors it is about are below it.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    error: np.ndarray
    shift: np.ndarray
    event_errors: tuple[float, ...]
    floor: np.ndarray
    promise: Promise = field(default_factory=Promise)
    rtol: float = 0.0
    method: str = ""
    cost: float = 1.0
    asked: str = ""
    met: bool = True

    def __getitem__(self, name: str) -> np.ndarray:
        """The error of a column by name, rows; KeyError where there is no such column."""
        try:
            return self.error[:, self.names.index(name)]
        except ValueError:
            raise KeyError(f"no column {name!r}") from None

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def largest(self, name: str) -> float:
        """The largest error of a column over the rows for which one is stated; not a number where there is none."""
        known = self[name][np.isfinite(self[name])]
        return float(known[-1]) if len(known) else np.nan

    def only(self, places: list[int]) -> Certainty:
        """The same of these columns alone (their places, without time)."""
        def some(names: tuple[str, ...]) -> tuple[str, ...]:
            return tuple(names[i] for i in places)

        return replace(self, names=some(self.names), units=some(self.units), error=self.error[:, places], floor=self.floor[places])

    def within(self, rows: np.ndarray, events: list[int]) -> Certainty:
        """The same of some rows (a mask) and events (their numbers) alone."""
        errors = tuple(self.event_errors[i] for i in events)
        return replace(self, error=self.error[rows], shift=self.shift[rows], event_errors=errors)

    def document(self) -> dict[str, Any]:
        """It as plain data: the promise, the largest error of each column, and those of the events."""
        p = self.promise
        return {
            "promise": {"until": p.until, "why": p.why, "about": p.about, "doubling": p.doubling, "text": str(p)},
            "errors": {n: self.largest(n) for n in self.names},
            "event_errors": list(self.event_errors),
            "largest_shift": float(self.shift.max(initial=0.0)),
            "accuracy": {"asked": self.asked, "met": self.met} if self.asked else None,
            "tighter": {"rtol": self.rtol, "method": self.method, "cost": self.cost},
        }

    def __str__(self) -> str:
        return f"errors of integration are stated {self.promise}" if self.promise.whole else str(self.promise)
