"""What a dispatcher remembers of a job it works on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from service.store.rows import Chunk, Job

FIRST_CHUNK = 8
LARGEST_CHUNK = 50_000
OUT_OF_TIME = {
    "where": "budget",
    "what": "the job's time budget is used up",
    "hint": "the results so far stand; submit the rest with a larger budget, or looser settings",
}


@dataclass
class Active:
    """A job being worked on. flying: chunks at the cluster, by first case; cost: stepping seconds a case, so far."""

    job: Job
    flying: dict[int, tuple[Chunk, Any]] = field(default_factory=dict)
    cost: float = 0.0
    warm: bool = False
    planned: int = 0
    nothing_until: float = 0.0
    looked: float = 0.0

    def size(self, seconds: float) -> int:
        """Cases the next chunk should have."""
        if self.cost <= 0.0:
            return FIRST_CHUNK
        return int(min(max(1, seconds / self.cost), LARGEST_CHUNK))
