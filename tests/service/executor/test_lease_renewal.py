"""A server renews its leases during long work. If it handles many chunks, no other server takes its jobs."""

from __future__ import annotations

import queue
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from trunnion.service.basics.prometheus_metrics import Metrics
from trunnion.service.executor import job_leases
from trunnion.service.executor.chunk_dispatcher import Dispatcher
from trunnion.service.executor.job_leases import LeasedJobs
from trunnion.service.store.leases_and_chunks import FailedAttempt, LeaseLost

LEASE, PIECES = 6.0, 100


class Clock:
    """A clock that advances with each action. It records the times at which the lease was renewed."""

    def __init__(self) -> None:
        self.now, self.renewed = 1000.0, list[float]()

    def claim(self, server: str, lease: float) -> list[Any]:
        self.renewed.append(self.now)
        return []

    def works(self, *given: Any) -> None:
        self.now += 1.0

    def reports(self, *given: Any) -> tuple[None, FailedAttempt]:
        self.works()
        return None, FailedAttempt("gone", 0.0)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(job_leases, "time", SimpleNamespace(monotonic=lambda: made.now))
    return made


def settled(jobs: LeasedJobs, clock: Clock) -> None:
    """Chunks of the previous server. Their parts can be read."""
    active = SimpleNamespace(job=SimpleNamespace(id="job"), document="", flying={}, follow=None, sure=False)
    chunks: Any = [SimpleNamespace(job="job", start=k, stop=k + 1) for k in range(PIECES)]
    parts: Any = SimpleNamespace(part=lambda piece: f"job/{piece.start}", names=lambda job: set(map(str, range(PIECES))))
    parts.part_outcomes, jobs.parts = clock.works, parts
    jobs.store.running = lambda job: chunks  # type: ignore[method-assign]
    jobs._settle_running(active)  # type: ignore[arg-type]
    assert active.sure


def recorded(jobs: LeasedJobs, clock: Clock) -> None:
    """Many chunks that return at once."""
    future, chunk = object(), SimpleNamespace(job="job", stop=1)
    flying = dict.fromkeys(range(PIECES), (chunk, future))
    many = {"planned": 0, "known": 1, "follow": None}
    active = SimpleNamespace(job=SimpleNamespace(id="job"), flying=flying, release_grant=lambda *given: None, **many)
    jobs.jobs["job"] = active  # type: ignore[assignment]
    jobs.returned = queue.SimpleQueue()
    for k in range(PIECES):
        jobs.returned.put(("job", k, future))
    jobs._report = clock.reports  # type: ignore[attr-defined]
    assert jobs._record_results()  # type: ignore[attr-defined]
    assert not flying


@pytest.mark.parametrize("many", [settled, recorded])
def test_leases_are_renewed_while_many_pieces_are_seen_to(many: Any, clock: Clock) -> None:
    def record_outcomes(server: str, job: str, done: Any, lost: Any, most: int) -> dict[int, str]:
        return dict.fromkeys(lost, "waiting")

    store = SimpleNamespace(claim=clock.claim, begin=lambda *given: None, record_outcomes=record_outcomes)
    jobs = Dispatcher(store, None, None, SimpleNamespace(lease=LEASE, attempts=5), Metrics())  # type: ignore[arg-type]
    jobs.claimed = began = clock.now
    many(jobs, clock)
    assert clock.now - began == PIECES
    times = [began, *clock.renewed, clock.now]
    # the limit is a third of the lease, plus the work that began before its end
    assert max(b - a for a, b in pairwise(times)) <= LEASE / 3 + 1.0
    assert jobs.claimed == began  # renewals leave ``claimed``, so the next turn starts jobs leased meanwhile


def test_a_lease_that_is_lost_while_its_job_is_taken_over_drops_this_job_only() -> None:
    def begin(server: str, job: str) -> None:
        if job == "lost":
            raise LeaseLost(job)

    claimed = [SimpleNamespace(id=x, state="running", seconds=0.0, build_seconds=0.0, planned=0, done=0) for x in ("lost", "kept")]
    store = SimpleNamespace(claim=lambda *given: claimed, begin=begin, document=lambda job: {}, running=lambda job: [])
    parts = SimpleNamespace(write=lambda *given: None, job_file=str)
    settings = SimpleNamespace(lease=LEASE, limits=SimpleNamespace(cpu_limit=1.0))
    jobs = Dispatcher(store, None, parts, settings, Metrics())  # type: ignore[arg-type]
    jobs._claim()
    assert list(jobs.jobs) == ["kept"]
