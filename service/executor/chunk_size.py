"""Sizes of chunks and pauses between checks. The sizes and pauses keep the load within the capacity of one dispatcher and one store
of parts, for any number of workers (``CAPACITY.md``)."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

BUSY = 0.5
"""Largest share of the dispatcher's time that is spent on dispatching chunks."""
NEW, MOST = 0.1, 0.05
"""NEW: weight of the newest commit in the estimated cost. MOST: upper limit of the time counted for a chunk, s, so that waiting for
an unreachable database does not count as cost."""
COMMIT_SIZE = 100
"""Largest number of chunks of a job in one database transaction (commit). A commit takes some hundredths of a second. After a
failure, the whole commit is repeated."""
CHECKS_PER_SECOND = 1000.0
"""Rate of the stop marker checks of all workers together, 1/s. Object stores accept some thousands of requests per second below one
prefix."""


@dataclass
class DispatchCost:
    """Estimated cost of dispatching chunks and storing their outcomes, from recent commits.

    The time of a commit with n chunks is fixed + each·n, s. sums: weighted sums over the commits of 1, n, n², time, and time·n."""

    fixed: float = 0.0
    each: float = 0.0
    sums: tuple[float, ...] = (0.0,) * 5

    def record(self, pieces: int, seconds: float) -> None:
        """Add a commit of ``pieces`` chunks that took ``seconds``, and fit ``fixed`` and ``each`` again by least squares. While all
        commits have the same number of chunks, their whole time counts as ``fixed``."""
        s = min(seconds, MOST * pieces)
        new = (1, pieces, pieces**2, s, pieces * s)
        n, p, pp, t, pt = self.sums = tuple((1.0 - NEW) * old + x for old, x in zip(self.sums, new, strict=True))
        rest = n * pp - p * p
        each = (n * pt - p * t) / rest if rest > 1e-3 * n * pp else 0.0
        self.each = min(max(0.0, each), t / p)
        self.fixed = (t - self.each * p) / n

    def cost(self, batch: int) -> float:
        """Time to send a chunk and store its outcome, s, when ``batch`` chunks share a commit."""
        return 2.0 * (self.fixed / batch + self.each)

    def longest(self, wanted: float, slots: int, batch: int) -> float:
        """The longest planned duration of a chunk, s: the larger of ``wanted`` and the time in which the dispatcher serves all
        slots once."""
        return max(wanted, slots * self.cost(min(batch, slots)) / BUSY)

    def shortest(self, work: float, slots: int, batch: int) -> float:
        """The shortest planned duration of a chunk, s, when ``work`` seconds of computing are left. The duration is the time in
        which the dispatcher serves all slots once, or √(work·cost) if this root is less. The root minimises the total time. P
        chunks on P slots end after P·cost + work/P, which is minimal for P = √(work/cost)."""
        cost = self.cost(min(batch, slots))
        return min(sqrt(work * cost), slots * cost / BUSY)


def check_pause(slots: int) -> float:
    """The shortest time between two checks of the stop marker by a worker, s. slots: number of workers."""
    return slots / CHECKS_PER_SECOND
