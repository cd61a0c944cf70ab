"""Caches of a server: contents of jobs, totals of tallies, lengths of responses."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from trunnion.analysis.studies.case_rounds import Study, StudyProgress
from trunnion.batch.sample_statistics.mergeable_statistics import Tally

if TYPE_CHECKING:
    from trunnion.batch.plan import Plan

CACHED_JOBS, CACHED_LENGTHS = 64, 256
CACHED_TALLIES = 4
"""Largest number of jobs whose tallies are cached. The tallies of one job need up to some hundred megabytes."""
Make = Callable[[], Iterator[bytes]]
"""A function that creates the bytes of a response."""


@dataclass(frozen=True)
class JobContents:
    """The immutable contents of a job's document: plan, schema of the result table, digest and text of the document."""

    plan: Plan
    schema: Any
    digest: str
    text: str


@dataclass
class JobCache:
    """The contents of recently read jobs, and the progress of recently read studies."""

    jobs: OrderedDict[str, JobContents] = field(default_factory=OrderedDict)
    lock: threading.Lock = field(default_factory=threading.Lock)
    follows: OrderedDict[str, StudyProgress] = field(default_factory=OrderedDict)
    following: threading.Lock = field(default_factory=threading.Lock)

    def follow(self, job: str, study: Callable[[], Study | None]) -> StudyProgress | None:
        """The study of a job with the results of its finished rounds; None for a job without a study."""
        with self.following:
            if job not in self.follows:
                made = study()
                if made is None:
                    return None
                self.follows[job] = StudyProgress(made)
                while len(self.follows) > CACHED_JOBS:
                    self.follows.popitem(last=False)
            return self.follows[job]


@dataclass
class JobTally:
    """The total of the tallies of a job. pieces: the case ranges (start, stop) that the total includes."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    pieces: set[tuple[int, int]] = field(default_factory=set)
    tally: Tally | None = None


@dataclass
class TallyCache:
    """The totals of recently queried jobs."""

    jobs: OrderedDict[str, JobTally] = field(default_factory=OrderedDict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def of(self, job: str) -> JobTally:
        with self.lock:
            found = self.jobs.setdefault(job, JobTally())
            self.jobs.move_to_end(job)
            while len(self.jobs) > CACHED_TALLIES:
                self.jobs.popitem(last=False)
            return found


class AnswerLengths:
    """The lengths of streamed responses by their entity tags."""

    def __init__(self) -> None:
        self.kept: OrderedDict[str, int] = OrderedDict()

    def of(self, tag: str, make: Make) -> int:
        """The number of bytes of a response. The first call for a tag generates the response and counts its bytes."""
        if tag not in self.kept:
            self.kept[tag] = sum(map(len, make()))
            while len(self.kept) > CACHED_LENGTHS:
                self.kept.popitem(last=False)
        return self.kept[tag]
