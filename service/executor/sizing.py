"""How large pieces are and how often workers look up, so that neither asks for more than one server and one store of parts can do,
however many workers there are (``GROWTH.md``)."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

BUSY = 0.5
"""Share of the dispatcher's time that handing out pieces may take."""
NEW, MOST = 0.1, 0.05
"""Weight of the newest commit in what pieces cost, and the most that one counts for, s a piece each way: a database that was away
costs no piece that."""
TOGETHER = 100
"""Pieces of a job that are handed out, recorded or settled in one commit, at most: it takes the database some hundredths of a
second, and all of them have to be done again where it breaks off."""
LOOKS_A_SECOND = 1000.0
"""Of all workers together at the file that stops a job; object stores take some thousands of requests a second below one prefix."""


@dataclass
class Handing:
    """What handing out pieces and recording their ends costs this server's one thread, as its commits of late say. fixed: s a
    commit; each: s a piece besides, each way; sums: of 1, pieces, pieces², s, pieces·s over commits, the newest weighing most."""

    fixed: float = 0.0
    each: float = 0.0
    sums: tuple[float, ...] = (0.0,) * 5

    def took(self, pieces: int, seconds: float) -> None:
        """So many were handed out or taken back in one commit: the line is fitted again (least squares). While all commits are
        alike, it is they that cost, not what is in them."""
        s = min(seconds, MOST * pieces)
        new = (1, pieces, pieces**2, s, pieces * s)
        n, p, pp, t, pt = self.sums = tuple((1.0 - NEW) * old + x for old, x in zip(self.sums, new, strict=True))
        rest = n * pp - p * p
        each = (n * pt - p * t) / rest if rest > 1e-3 * n * pp else 0.0
        self.each = min(max(0.0, each), t / p)
        self.fixed = (t - self.each * p) / n

    def cost(self, batch: int) -> float:
        """s of a piece, there and back, of so many that share a commit."""
        return 2.0 * (self.fixed / batch + self.each)

    def longest(self, wanted: float, slots: int, batch: int) -> float:
        """Seconds that a piece should take at most: ``wanted``, or as long as it takes to serve all slots once."""
        return max(wanted, slots * self.cost(min(batch, slots)) / BUSY)

    def shortest(self, work: float, slots: int, batch: int) -> float:
        """Seconds that a piece should take at least with so many seconds of work left: as long as it takes to serve all slots once,
        where there is so much work; else so long that handing out the rest takes no longer than doing it (P pieces for P slots end
        after P·cost + work/P, which is least for pieces of √(work·cost))."""
        cost = self.cost(min(batch, slots))
        return min(sqrt(work * cost), slots * cost / BUSY)


def look_pause(slots: int) -> float:
    """Seconds between two looks of each of so many workers, at least."""
    return slots / LOOKS_A_SECOND
