"""The state of a job on which the dispatcher works."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import Any

from trunnion.analysis.studies.study_rounds import StudyProgress
from trunnion.service.executor.chunk_and_case_runs import WALL_FACTOR
from trunnion.service.executor.chunk_size import COMMIT_SIZE, DispatchCost
from trunnion.service.store.store_records import Chunk, Job

FIRST_CHUNK = 8
LARGEST_CHUNK = 100_000
"""Largest number of cases in a chunk. A worker needs about 2 kB of memory for each case."""
SHORTEST = 0.1
"""Shortest planned duration of a chunk, s. The dispatch of shorter chunks would cost too much time."""
CHUNKS_PER_SLOT = 30
OUT_OF_TIME = {
    "where": "budget",
    "what": "the job has used its whole time budget",
    "hint": "the results so far are valid; submit the other cases with a larger budget or looser settings",
}


OVERRUN, SHORTEST_OVERRUN = 4.0, 1.0
"""A chunk is split if it takes longer than OVERRUN times the longest planned duration and longer than SHORTEST_OVERRUN seconds. The
other cases of the chunk can then finish."""
BUILDING = 60.0
"""Time for building, s, that a chunk gets from the budget in addition to its time of stepping. Later chunks need this time, too,
because a case can need another kernel."""
LEAST_GRANT, LEAST_LEFT = 0.25, 0.01
"""LEAST_GRANT: smallest grant while other chunks run, s. LEAST_LEFT: if less than this is left of the budget, s, the budget counts
as used up."""


@dataclass
class ActiveJob:
    """A job on which the dispatcher works. flying: (chunk, future) of each chunk on the cluster, by first case. granted: time that
    the budget reserves for each chunk on the cluster, s. spent: used part of the budget, s. cost: mean computing time of a case, s;
    0 before the first chunk. warm: whether the kernel is built. planned: number of cases in all chunks that were cut. document:
    digest of the job's document. follow: the study whose results determine the cases. apart: whether each case is a separate chunk
    (for a fit). sure: whether ``flying`` contains all chunks that are stored as running; False after an interrupted write."""

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
        """Number of cases that are known at present. A study chooses its cases round by round."""
        return self.job.cases if self.follow is None else self.follow.requested

    @property
    def left(self) -> float:
        """The part of the budget that is neither used nor granted, s. The sum of all grants never exceeds the budget."""
        return self.job.budget - self.spent - sum(self.granted.values())

    def time_grant(self, chunk: Chunk, longest: float, slots: int) -> tuple[float, float]:
        """Two time limits of a chunk, s: for building and stepping together, and for stepping alone. A chunk with one case gets all
        the time that the CPU-time limit of the case allows. If little of the budget is left, a chunk gets only a share of the
        rest."""
        if self.apart:
            return self.left / max(1, self.known - self.planned + 1), inf
        if chunk.stop - chunk.start == 1:
            return min(self.left, WALL_FACTOR * self.cpu_limit + BUILDING), inf
        overrun = max(OVERRUN * longest, SHORTEST_OVERRUN)
        if not self.warm:
            return self.left, overrun
        return min(self.left, max(LEAST_GRANT, min(overrun + BUILDING, self.left / (2 * slots)))), overrun

    def release_grant(self, start: int, seconds: float) -> None:
        """Release the grant of a returned chunk and add its used time, s, to ``spent``."""
        self.granted.pop(start, None)
        self.spent += seconds

    def chunks_at_once(self, most: int) -> int:
        """Number of chunks to cut in one database transaction: as many as the remaining budget allows, at most ``most``."""
        return int(max(1, min(most, COMMIT_SIZE, self.left / (WALL_FACTOR * self.cpu_limit + BUILDING)))) if self.warm else 1

    def sizes(self, count: int, longest: float, slots: int, dispatch_cost: DispatchCost) -> list[int]:
        """Number of cases in each of the next ``count`` chunks."""
        found, planned = list[int](), self.planned
        for _ in range(count):
            found.append(self.size(longest, slots, dispatch_cost, planned))
            planned = min(self.known, planned + found[-1])
        return found

    def size(self, longest: float, slots: int, dispatch_cost: DispatchCost, planned: int | None = None) -> int:
        """Number of cases in the next chunk, after ``planned`` cases. The remaining cases are divided into CHUNKS_PER_SLOT chunks
        for each slot. The duration of a chunk is at most ``longest`` seconds, and at least SHORTEST and the shortest duration that
        the dispatcher can serve. Chunks become smaller towards the end of the job."""
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
