"""A server keeps its leases while it is busy with what is long: nobody takes its jobs because there are many pieces to see to."""

from __future__ import annotations

import queue
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from service.executor import held
from service.executor.dispatcher import Dispatcher
from service.executor.held import HeldJobs

LEASE, PIECES = 6.0, 100


class Clock:
    """A clock that goes on when something is done, and when its lease was renewed."""

    def __init__(self) -> None:
        self.now, self.renewed = 1000.0, list[float]()

    def claim(self, server: str, lease: float) -> list[Any]:
        self.renewed.append(self.now)
        return []

    def works(self, *given: Any) -> None:
        self.now += 1.0


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(held, "time", SimpleNamespace(monotonic=lambda: made.now))
    return made


def settled_one_by_one(jobs: HeldJobs, clock: Clock) -> None:
    """Pieces of the server before this one."""
    active = SimpleNamespace(job=SimpleNamespace(id="job"), flying={}, follow=None, sure=False)
    jobs.store.running = lambda job: [SimpleNamespace(start=k) for k in range(PIECES)]  # type: ignore[method-assign]
    jobs._settle = clock.works  # type: ignore[method-assign]
    jobs._take_stock(active)  # type: ignore[arg-type]
    assert active.sure


def recorded_one_by_one(jobs: HeldJobs, clock: Clock) -> None:
    """Pieces that came back all at once."""
    future = object()
    jobs.jobs["job"] = SimpleNamespace(flying=dict.fromkeys(range(PIECES), (None, future)))  # type: ignore[assignment]
    jobs.landed = queue.SimpleQueue()
    for k in range(PIECES):
        jobs.landed.put(("job", k, future))
    jobs._landed = clock.works  # type: ignore[attr-defined]
    assert Dispatcher._take_landed(jobs)  # type: ignore[arg-type]


@pytest.mark.parametrize("many", [settled_one_by_one, recorded_one_by_one])
def test_leases_are_renewed_while_many_pieces_are_seen_to(many: Any, clock: Clock) -> None:
    store = SimpleNamespace(claim=clock.claim, begin=lambda *given: None)
    jobs = HeldJobs(store, None, SimpleNamespace(lease=LEASE))  # type: ignore[arg-type]
    jobs.claimed = began = clock.now
    many(jobs, clock)
    assert clock.now - began == PIECES
    times = [began, *clock.renewed, clock.now]
    assert max(b - a for a, b in pairwise(times)) <= LEASE / 3 + 1.0  # a third, and what was begun before it was over
    assert jobs.claimed == began  # a job that has come meanwhile is not passed over
