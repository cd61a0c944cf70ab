"""What a dispatcher remembers of a job it works on."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import Any

from engine.studies.following import Follow
from service.executor.sizing import TOGETHER, Handing
from service.store.rows import Chunk, Job

FIRST_CHUNK = 8
LARGEST_CHUNK = 100_000
"""Cases of a piece: a worker has some 2 kB for each while it runs."""
SHORTEST = 0.1
"""Seconds of stepping below which handing a chunk out costs too large a share."""
PIECES = 30
OUT_OF_TIME = {
    "where": "budget",
    "what": "the job's budget of time is used up",
    "hint": "the results so far stand; submit the rest with a larger budget, or looser settings",
}


OVERRUN, SHORTEST_OVERRUN = 4.0, 1.0
"""A piece that takes so many times as long as a piece should, and so many seconds, is split, so that its other cases come
through."""
BUILDING = 60.0
"""Seconds granted beside the stepping, where the job's budget has them: a later case may need a kernel of its own."""
LEAST_GRANT, LEAST_LEFT = 0.25, 0.01
"""Seconds below which a piece is not worth handing out while others still have some of the budget, and below which it is used
up."""
WALL = 10.0
"""How many times its processor seconds a case may take by the clock, on a machine that is busy with other things."""


@dataclass
class Active:
    """A job being worked on. flying: (chunk, future) at the cluster by the chunk's first case; granted: seconds of the budget that
    each of them may use; spent: seconds used so far; cost: mean stepping seconds for a case so far, 0 before the first chunk;
    planned: cases handed out; document: digest of the job's document; follow: the study, of a job whose cases follow from
    results; apart: whether each case is a piece of its own that takes what it takes (a fit); sure: whether every chunk that is
    recorded as running is flying, which nobody knows after a write that broke off."""

    job: Job
    flying: dict[int, tuple[Chunk, Any]] = field(default_factory=dict)
    granted: dict[int, float] = field(default_factory=dict)
    spent: float = 0.0
    document: str = ""
    patience: float = 600.0
    cost: float = 0.0
    warm: bool = False
    planned: int = 0
    nothing_until: float = 0.0
    looked: float = 0.0
    follow: Follow | None = None
    apart: bool = False
    sure: bool = False

    @property
    def known(self) -> int:
        """How many of its cases are known."""
        return self.job.cases if self.follow is None else self.follow.asked

    @property
    def left(self) -> float:
        """Seconds of the budget that are neither used nor granted: what is handed out never adds up to more than the budget."""
        return self.job.budget - self.spent - sum(self.granted.values())

    def grant(self, chunk: Chunk, longest: float, slots: int) -> tuple[float, float]:
        """(seconds that a chunk may build and step, seconds it may step), of what is left. A case alone gets all that its patience
        asks for; of what is not enough for everybody a piece gets its share."""
        if self.apart:
            return self.left / max(1, self.known - self.planned + 1), inf
        if chunk.stop - chunk.start == 1:
            return min(self.left, WALL * self.patience + BUILDING), inf
        overrun = max(OVERRUN * longest, SHORTEST_OVERRUN)
        if not self.warm:
            return self.left, overrun
        return min(self.left, max(LEAST_GRANT, min(overrun + BUILDING, self.left / (2 * slots)))), overrun

    def landed(self, start: int, seconds: float) -> None:
        """A chunk has come back, having used so many seconds."""
        self.granted.pop(start, None)
        self.spent += seconds

    def together(self, most: int) -> int:
        """How many chunks may be cut at once, at most ``most``: as many as there is time for, whatever each is granted."""
        return int(max(1, min(most, TOGETHER, self.left / (WALL * self.patience + BUILDING)))) if self.warm else 1

    def sizes(self, count: int, longest: float, slots: int, handing: Handing) -> list[int]:
        """Numbers of cases for the next chunks, as they are when one is cut after the other."""
        found, planned = list[int](), self.planned
        for _ in range(count):
            found.append(self.size(longest, slots, handing, planned))
            planned = min(self.known, planned + found[-1])
        return found

    def size(self, longest: float, slots: int, handing: Handing, planned: int | None = None) -> int:
        """Number of cases for the next chunk, where so many are ``planned``. What is left is cut into PIECES chunks for each slot,
        so that a small job spreads, but into none longer than ``longest`` seconds, or shorter than SHORTEST and than what handing
        out more of them is worth; chunks shrink towards the end."""
        if self.apart:
            return 1
        if self.cost <= 0.0:
            return FIRST_CHUNK
        left = max(1, self.known - (self.planned if planned is None else planned))
        share = max(SHORTEST, self.left / (4 * slots))
        least = handing.shortest(left * self.cost, slots, self.together(slots))
        seconds = min(longest, share, max(SHORTEST, least, left * self.cost / (slots * PIECES)))
        spread = max(1, left // (2 * slots), int(min(longest, least) / self.cost))
        return int(min(max(1, seconds / self.cost), LARGEST_CHUNK, spread))
