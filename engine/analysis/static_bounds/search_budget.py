"""Cost limits of searches: a number of cells for each search, and a time in seconds for all searches together."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np


class SearchBudget:
    """The cost limits. cells: largest number of cells of each search. seconds: time for all searches; None means no limit. asked:
    whether Ctrl-C was pressed. searches: expected number of searches."""

    def __init__(
        self, cells: int, seconds: float | None = None, asked: Callable[[], bool] = lambda: False, searches: int = 1
    ):  # fmt: skip
        self.cells, self.asked, self.searches = cells, asked, searches
        self.end = np.inf if seconds is None else time.monotonic() + seconds
        self.until = self.end
        self.short = 0

    def begin(self, part: float = 0.0) -> None:
        """Begin a search. The time of the search is an equal share of the remaining time, or the fraction ``part`` of the remaining
        time if that is longer."""
        now = time.monotonic()
        self.until = now + max(0.0, self.end - now) * max(part, 1.0 / max(1, self.searches))
        self.searches -= 1

    def is_over(self) -> bool:
        """Whether the search must stop."""
        return self.asked() or time.monotonic() >= self.until

    @property
    def ended(self) -> str:
        """"done", "budget" (the time limit ended searches early) or "cancelled" (Ctrl-C)."""
        return "cancelled" if self.asked() else "budget" if self.short else "done"
