"""How much a question may cost: cells for each search, and seconds for all of them, of which each has its share of what is left."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np


class Effort:
    """What may be spent. cells: most of each search; seconds: for all of them (None: no limit); asked: whether Ctrl-C was pressed;
    searches: how many there will be."""

    def __init__(
        self, cells: int, seconds: float | None = None, asked: Callable[[], bool] = lambda: False, searches: int = 1
    ):  # fmt: skip
        self.cells, self.asked, self.searches = cells, asked, searches
        self.end = np.inf if seconds is None else time.monotonic() + seconds
        self.until = self.end
        self.short = 0

    def begin(self, part: float = 0.0) -> None:
        """A search begins: it may take its share of the time left, or this part of it."""
        now = time.monotonic()
        self.until = now + max(0.0, self.end - now) * max(part, 1.0 / max(1, self.searches))
        self.searches -= 1

    def over(self) -> bool:
        """Whether to stop here."""
        return self.asked() or time.monotonic() >= self.until

    @property
    def ended(self) -> str:
        """How it all ended: "done", or with searches cut short by the "budget", or "stopped" by Ctrl-C."""
        return "stopped" if self.asked() else "budget" if self.short else "done"
