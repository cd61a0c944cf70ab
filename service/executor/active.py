"""What a dispatcher remembers of a job it works on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from service.store.rows import Chunk, Job

FIRST_CHUNK = 8
LARGEST_CHUNK = 50_000
SHORTEST = 0.1
"""Seconds of stepping below which handing a chunk out costs too large a share."""
PIECES = 30
OUT_OF_TIME = {
    "where": "budget",
    "what": "the job's time budget is used up",
    "hint": "the results so far stand; submit the rest with a larger budget, or looser settings",
}


@dataclass
class Active:
    """A job being worked on. flying: (chunk, future) at the cluster by the chunk's first case; cost: mean stepping seconds for a
    case so far, 0 before the first chunk; planned: cases handed out."""

    job: Job
    flying: dict[int, tuple[Chunk, Any]] = field(default_factory=dict)
    cost: float = 0.0
    warm: bool = False
    planned: int = 0
    nothing_until: float = 0.0
    looked: float = 0.0

    def size(self, longest: float, slots: int) -> int:
        """Number of cases for the next chunk. What is left is cut into PIECES chunks for each slot, so that a small job spreads,
        but into none shorter than SHORTEST or longer than ``longest`` seconds; chunks shrink towards the end."""
        if self.cost <= 0.0:
            return FIRST_CHUNK
        left = max(1, self.job.cases - self.planned)
        seconds = min(longest, max(SHORTEST, left * self.cost / (slots * PIECES)))
        return int(min(max(1, seconds / self.cost), LARGEST_CHUNK, max(1, left // (2 * slots))))
