"""How large pieces are and how often workers look up, so that neither asks for more than one server and one store of parts can do,
however many workers there are (``GROWTH.md``)."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

BUSY = 0.5
"""Share of the dispatcher's time that handing out pieces may take."""
NEW, MOST = 0.1, 0.1
"""Weight of the newest turn in what a piece costs, and the most that one counts for, s: a database that was away costs no piece
that."""
TOGETHER = 100
"""Pieces of a job that are handed out, recorded or settled in one commit, at most: it takes the database some hundredths of a
second, and all of them have to be done again where it breaks off."""
LOOKS_A_SECOND = 1000.0
"""Of all workers together at the file that stops a job; object stores take some thousands of requests a second below one prefix."""


@dataclass
class Handing:
    """What handing out a piece and recording its end cost this server's one thread. cost: s a piece, as turns of late say."""

    cost: float = 0.0

    def turned(self, moved: int, seconds: float) -> None:
        """A turn handed out or took back so many pieces."""
        if moved:
            now = min(2.0 * seconds / moved, MOST)
            self.cost += (now - self.cost) * (NEW if self.cost else 1.0)

    def longest(self, wanted: float, slots: int) -> float:
        """Seconds that a piece should take at most: ``wanted``, or as long as it takes to serve all slots once."""
        return max(wanted, slots * self.cost / BUSY)

    def shortest(self, work: float, slots: int) -> float:
        """Seconds that a piece should take at least with so many seconds of work left: as long as it takes to serve all slots once,
        where there is so much work; else so long that handing out the rest takes no longer than doing it (P pieces for P slots end
        after P·cost + work/P, which is least for pieces of √(work·cost))."""
        return min(sqrt(work * self.cost), slots * self.cost / BUSY)


def look_pause(slots: int) -> float:
    """Seconds between two looks of each of so many workers, at least."""
    return slots / LOOKS_A_SECOND
