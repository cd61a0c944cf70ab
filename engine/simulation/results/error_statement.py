"""The error statement of a run: errors of every column and row, errors of event times, and the time up to which they are valid."""

from __future__ import annotations

from dataclasses import field, replace
from math import inf
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass

REASONS = {
    "": "",
    "events": "a run at a tighter tolerance has different events",
    "marginal": "an event was decided by a margin smaller than the run's own error",
    "growth": "errors have grown too large for an estimate",
    "outcome": "a run at a tighter tolerance has a different outcome",
    "cost": "the run at a tighter tolerance reached its limit: 1.5 times the cost of the first run",
    "cancelled": "the run at a tighter tolerance was cancelled",
    "start": "the run was cancelled, or could not start",
}
"""{reason why no error is stated from some time on: its text}."""


def rough(error: float) -> str:
    """An error as text, with one significant digit."""
    return f"{float(f'{error:.1g}'):g}"


@dataclass(frozen=True)
class Promise:
    """The validity of the stated errors.

    Attributes:
        until: time from which no error is stated, s; infinite if the errors are valid to the end.
        why: key of ``REASONS``; "" if the errors are valid to the end.
        about: description of the event or outcome at the time ``until``.
        doubling: doubling time of growing errors, s; infinite if unknown.
    """

    until: float = inf
    why: str = ""
    about: str = ""
    doubling: float = inf

    @property
    def whole(self) -> bool:
        """Whether the errors are valid to the end of the run."""
        return not self.why

    def __str__(self) -> str:
        if self.whole:
            return "to the end of the run"
        return f"no error is stated from t = {self.until:.6g} s: {REASONS[self.why]}" + (f" ({self.about})" if self.about else "")


@dataclass(frozen=True)
class Certainty:
    """The global error of a run, caused by integration and round-off.

    Attributes:
        names: names of the columns (c), without time.
        units: units of the columns (c).
        error: largest error up to each row (n × c), in the column's unit; NaN where no error is stated, and for columns without
            errors, such as ``audit.*``.
        shift: error of the time of an event near each row (n), s; 0 if there is no event near the row. If the shift is not 0, a
            column that jumps at the event may have the value before or after the jump.
        event_errors: error of the time of each event, s.
        floor: smallest error that can be stated for each column (c), in its unit.
        promise: validity of the errors.
        rtol: tolerance of the tighter run.
        method: method of the tighter run.
        cost: number of evaluations of both runs, divided by that of the first run.
        asked: requested accuracy; "" if none was requested.
        met: whether all errors to which the accuracy applies are at most the accuracy.
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
        """The error of a column (n); raises KeyError for unknown names."""
        try:
            return self.error[:, self.names.index(name)]
        except ValueError:
            raise KeyError(f"no column {name!r}") from None

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def largest(self, name: str) -> float:
        """The largest stated error of a column; NaN if no error is stated."""
        known = self[name][np.isfinite(self[name])]
        return float(known[-1]) if len(known) else np.nan

    def only(self, places: list[int]) -> Certainty:
        """The statement for some of the columns. places: indices of the columns, not counting time."""
        names, units = (tuple(x[i] for i in places) for x in (self.names, self.units))
        return replace(self, names=names, units=units, error=self.error[:, places], floor=self.floor[places])

    def within(self, rows: np.ndarray, events: list[int]) -> Certainty:
        """The statement for some rows (mask) and events (indices)."""
        errors = tuple(self.event_errors[i] for i in events)
        return replace(self, error=self.error[rows], shift=self.shift[rows], event_errors=errors)

    def document(self) -> dict[str, Any]:
        """The statement as plain data: validity, largest error of each column, errors of event times."""
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
