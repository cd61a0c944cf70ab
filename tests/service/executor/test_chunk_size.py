"""The sizes of chunks let one server send all chunks and one store record all results, for any number of workers."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from tests.benchmarks.service.worker_count_model import Fleet, simulated
from trunnion.service.executor.active_job import ActiveJob
from trunnion.service.executor.chunk_and_case_runs import MARKER_SECONDS
from trunnion.service.executor.chunk_size import BUSY, CHECKS_PER_SECOND, COMMIT_SIZE, DispatchCost, check_pause
from trunnion.service.store.store_records import Job

CASE = 1e-3
"""Time of a case, s."""
PIECE = 5e-3
"""Time of the dispatcher for each piece, s."""


def active(cases: int, planned: int = 0) -> ActiveJob:
    job = Job("", 0.0, None, None, "", "", "", "", "running", cases, planned, 0, 0, {}, 0.0, 0.0, 0, math.inf, [])
    return ActiveJob(job, cost=CASE, warm=True, planned=planned)


@pytest.mark.parametrize("slots", [1, 2, 16, 200, 1000, 10_000])
def test_pieces_last_as_long_as_it_takes_to_serve_all_workers(slots: int) -> None:
    dispatch_cost = DispatchCost(each=PIECE / 2)
    longest = dispatch_cost.longest(2.0, slots, 1)
    assert slots / longest <= BUSY / PIECE, "pieces a second"
    seconds = CASE * active(10**9).size(longest, slots, dispatch_cost)
    assert PIECE * slots <= seconds <= longest * (1 + 1e-9)
    if slots <= 2.0 * BUSY / PIECE:
        assert longest == 2.0, "few workers have pieces of the size as before"


def test_a_small_job_is_cut_as_before_for_few_workers_and_into_no_more_than_pays_for_many() -> None:
    for cases in (200, 1000, 5000, 100_000):
        assert active(cases).size(2.0, 2, DispatchCost(each=PIECE / 2)) == active(cases).size(2.0, 2, DispatchCost()), cases
    many, dispatch_cost = 10_000, DispatchCost(each=PIECE / 2)
    at, pieces = 0, 0
    while at < 100_000:
        at, pieces = at + active(100_000, at).size(dispatch_cost.longest(2.0, many, 1), many, dispatch_cost), pieces + 1
    assert pieces < 4 * math.sqrt(100_000 * CASE / PIECE), "P pieces end after P·cost + work/P"


def test_the_cost_of_commits_and_pieces_is_learnt_and_an_outage_does_not_count() -> None:
    dispatch_cost, fixed, each = DispatchCost(), 0.01, 0.0004
    dispatch_cost.record(1, fixed + each)
    assert dispatch_cost.cost(1) == pytest.approx(2 * (fixed + each))
    for k in range(200):
        for pieces in (1, 1 + 10 * k % 90):
            dispatch_cost.record(pieces, fixed + pieces * each)
    assert (dispatch_cost.fixed, dispatch_cost.each) == (pytest.approx(fixed), pytest.approx(each))
    assert dispatch_cost.cost(1) == pytest.approx(2 * (fixed + each))
    assert dispatch_cost.cost(100) == pytest.approx(2 * (fixed / 100 + each))
    dispatch_cost.record(1, 1000.0)
    assert dispatch_cost.cost(1) < 8 * (fixed + each)
    assert min(dispatch_cost.fixed, dispatch_cost.each) >= 0.0


def test_many_workers_have_short_pieces_where_many_are_handed_out_together() -> None:
    dispatch_cost = DispatchCost(0.016, 0.0004)
    alone, together = (dispatch_cost.longest(2.0, 10_000, batch) for batch in (1, COMMIT_SIZE))
    assert together < alone / 20
    assert dispatch_cost.longest(2.0, 1, COMMIT_SIZE) == dispatch_cost.longest(2.0, 1, 1), "one worker has one at a time"


@pytest.mark.slow
def test_ten_thousand_workers_have_their_fill_of_a_thousand_million_cases() -> None:
    """In the model of CAPACITY.md, chunks of two seconds would leave nine tenths of the workers idle."""
    fleet = Fleet(workers=10_000, case=CASE, cut=PIECE / 2, land=PIECE / 2)
    grown, fixed = (simulated(cases, fleet, learns=learns) for cases, learns in ((10**9, True), (10**7, False)))
    assert grown.share > 0.45
    assert fixed.share < 0.1
    assert grown.pieces * PIECE < grown.seconds
    slow = Fleet(workers=10_000, case=CASE, cut=8e-3, land=8e-3)
    one, many = (simulated(10**9, fleet) for fleet in (slow, replace(slow, each=4e-4, together=COMMIT_SIZE)))
    assert one.share < 0.5 < 0.9 < many.share, "a hundred pieces in a commit"
    few = Fleet(workers=16, case=CASE, cut=PIECE / 2, land=PIECE / 2)
    assert all(simulated(10**6, few, learns=learns).share > 0.9 for learns in (True, False))


def test_all_workers_together_look_for_the_mark_of_a_stopped_job_no_oftener_than_a_store_can_bear() -> None:
    for slots in (1, 100, 1000, 10_000):
        pause = max(MARKER_SECONDS, check_pause(slots))
        assert slots / pause <= CHECKS_PER_SECOND
        assert slots > 100 or pause == MARKER_SECONDS
