"""Sizes of chunks and pauses between checks for any number of workers, within the capacity of one dispatcher and one store of parts
(``CAPACITY.md``)."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

BUSY = 0.5
"""Share of the dispatcher's time for dispatching chunks."""
NEW, MOST = 0.1, 0.05
"""Weight of the newest commit in the estimated cost, and the most seconds counted for a chunk: an unreachable database is not a
cost."""
COMMIT_SIZE = 100
"""Most chunks of a job in one commit. A commit takes some hundredths of a second, and is repeated whole after a failure."""
CHECKS_PER_SECOND = 1000.0
"""Checks of stop markers by all workers together; object stores take some thousands of requests a second below one prefix."""


@dataclass
class DispatchCost:
    """Estimated cost of dispatching chunks and storing their outcomes, from recent commits.

    fixed: s of a commit. each: s of a chunk, each way. sums: weighted sums of 1, chunks, chunks², s, s·chunks over commits."""

    fixed: float = 0.0
    each: float = 0.0
    sums: tuple[float, ...] = (0.0,) * 5

    def record(self, pieces: int, seconds: float) -> None:
        """Add a commit and fit the line again (least squares). While all commits have the same size, their whole cost counts as
        fixed."""
        s = min(seconds, MOST * pieces)
        new = (1, pieces, pieces**2, s, pieces * s)
        n, p, pp, t, pt = self.sums = tuple((1.0 - NEW) * old + x for old, x in zip(self.sums, new, strict=True))
        rest = n * pp - p * p
        each = (n * pt - p * t) / rest if rest > 1e-3 * n * pp else 0.0
        self.each = min(max(0.0, each), t / p)
        self.fixed = (t - self.each * p) / n

    def cost(self, batch: int) -> float:
        """Seconds of a chunk, both ways, when ``batch`` chunks share a commit."""
        return 2.0 * (self.fixed / batch + self.each)

    def longest(self, wanted: float, slots: int, batch: int) -> float:
        """Longest duration of a chunk, s: ``wanted``, or the time to serve all slots once."""
        return max(wanted, slots * self.cost(min(batch, slots)) / BUSY)

    def shortest(self, work: float, slots: int, batch: int) -> float:
        """Shortest duration of a chunk, s, with ``work`` seconds left. It is the time to serve all slots once, or √(work·cost) when
        less work is left: P chunks on P slots end after P·cost + work/P."""
        cost = self.cost(min(batch, slots))
        return min(sqrt(work * cost), slots * cost / BUSY)


def check_pause(slots: int) -> float:
    """Least seconds between two checks by a worker, given the number of workers."""
    return slots / CHECKS_PER_SECOND
