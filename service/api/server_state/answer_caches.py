"""Contents of the caches of a server."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

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
class JobTally:
    """The total of the tallies of a job. pieces: the case ranges (start, stop) that the total includes."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    pieces: set[tuple[int, int]] = field(default_factory=set)
    tally: Tally | None = None
