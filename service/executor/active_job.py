"""State of a job on which the dispatcher works."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import Any

from trunnion.analysis.studies.case_rounds import StudyProgress
from trunnion.service.executor.chunk_size import COMMIT_SIZE, DispatchCost
from trunnion.service.store.job_and_chunk_records import Chunk, Job

FIRST_CHUNK = 8
LARGEST_CHUNK = 100_000
"""Cases of a chunk: a worker needs about 2 kB for each."""
SHORTEST = 0.1
"""Shortest chunk in seconds of stepping; shorter ones cost too much dispatch time."""
CHUNKS_PER_SLOT = 30
OUT_OF_TIME = {
    "where": "budget",
    "what": "the job has used its whole time budget",
    "hint": "the results so far are valid; submit the rest with a larger budget or looser settings",
}


OVERRUN, SHORTEST_OVERRUN = 4.0, 1.0
"""A chunk that exceeds this multiple of the longest duration, and this number of seconds, is split so that its other cases
finish."""
BUILDING = 60.0
"""Seconds granted in addition to the stepping, within the budget, because a later case can need another kernel."""
LEAST_GRANT, LEAST_LEFT = 0.25, 0.01
"""Least grant in seconds while other chunks run, and the remaining budget that counts as used up."""
WALL_FACTOR = 10.0
"""Wall seconds that a case may take for each processor second of its limit, on a busy machine."""


@dataclass
class Active:
    """A job that the dispatcher works on. flying: (chunk, future) on the cluster, by first case. granted: seconds of the budget
    reserved for each such chunk. spent: seconds used. cost: mean computing seconds of a case, 0 before the first chunk. warm:
    whether the kernel is built. planned: cases in chunks so far. document: digest of the job's document. follow: the study whose
    results determine the cases. apart: whether each case is a chunk of its own (a fit). sure: whether every chunk stored as
    running is in ``flying``; unknown after an interrupted write."""

    job: Job
    flying: dict[int, tuple[Chunk, Any]] = field(default_factory=dict)
    granted: dict[int, float] = field(default_factory=dict)
    spent: float = 0.0
    document: str = ""
    cpu_limit: float = 600.0
    cost: float = 0.0
    warm: bool = False
    planned: int = 0
    nothing_until: float = 0.0
    looked: float = 0.0
    follow: StudyProgress | None = None
    apart: bool = False
    sure: bool = False

    @property
    def known(self) -> int:
        """Number of cases known so far."""
        return self.job.cases if self.follow is None else self.follow.requested

    @property
    def left(self) -> float:
        """Seconds of the budget neither used nor granted; the sum of grants never exceeds the budget."""
        return self.job.budget - self.spent - sum(self.granted.values())

    def time_grant(self, chunk: Chunk, longest: float, slots: int) -> tuple[float, float]:
        """Time limits of a chunk, s: (building and stepping, stepping alone). A chunk of one case gets all that its CPU-time
        limit allows. If the budget is short, a chunk gets its share."""
        if self.apart:
            return self.left / max(1, self.known - self.planned + 1), inf
        if chunk.stop - chunk.start == 1:
            return min(self.left, WALL_FACTOR * self.cpu_limit + BUILDING), inf
        overrun = max(OVERRUN * longest, SHORTEST_OVERRUN)
        if not self.warm:
            return self.left, overrun
        return min(self.left, max(LEAST_GRANT, min(overrun + BUILDING, self.left / (2 * slots)))), overrun

    def release_grant(self, start: int, seconds: float) -> None:
        """Release the grant of a returned chunk and count its seconds."""
        self.granted.pop(start, None)
        self.spent += seconds

    def chunks_at_once(self, most: int) -> int:
        """Number of chunks to cut at once, at most ``most``: as many as the remaining budget allows."""
        return int(max(1, min(most, COMMIT_SIZE, self.left / (WALL_FACTOR * self.cpu_limit + BUILDING)))) if self.warm else 1

    def sizes(self, count: int, longest: float, slots: int, dispatch_cost: DispatchCost) -> list[int]:
        """Numbers of cases of the next chunks."""
        found, planned = list[int](), self.planned
        for _ in range(count):
            found.append(self.size(longest, slots, dispatch_cost, planned))
            planned = min(self.known, planned + found[-1])
        return found

    def size(self, longest: float, slots: int, dispatch_cost: DispatchCost, planned: int | None = None) -> int:
        """Number of cases of the next chunk after ``planned`` cases. The rest is divided into CHUNKS_PER_SLOT chunks for each slot,
        within ``longest`` seconds, SHORTEST, and the shortest duration that dispatch can serve. Chunks shrink towards the end."""
        if self.apart:
            return 1
        if self.cost <= 0.0:
            return FIRST_CHUNK
        left = max(1, self.known - (self.planned if planned is None else planned))
        share = max(SHORTEST, self.left / (4 * slots))
        least = dispatch_cost.shortest(left * self.cost, slots, self.chunks_at_once(slots))
        seconds = min(longest, share, max(SHORTEST, least, left * self.cost / (slots * CHUNKS_PER_SLOT)))
        spread = max(1, left // (2 * slots), int(min(longest, least) / self.cost))
        return int(min(max(1, seconds / self.cost), LARGEST_CHUNK, spread))
