"""However many workers there are, one server can hand out what they ask for, and one store answer them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from service.executor.active import Active
from service.executor.sizing import BUSY, LOOKS_A_SECOND, TOGETHER, Handing, look_pause
from service.executor.work import MARKER_SECONDS
from service.store.rows import Job
from tests.benchmarks.growth import Fleet, simulated

CASE = 1e-3
"""s a case."""
PIECE = 5e-3
"""s of the dispatcher a piece."""


def active(cases: int, planned: int = 0) -> Active:
    job = Job("", 0.0, None, None, "", "", "", "", "running", cases, planned, 0, 0, {}, 0.0, 0.0, 0, math.inf, [])
    return Active(job, cost=CASE, warm=True, planned=planned)


@pytest.mark.parametrize("slots", [1, 2, 16, 200, 1000, 10_000])
def test_pieces_last_as_long_as_it_takes_to_serve_all_workers(slots: int) -> None:
    handing = Handing(each=PIECE / 2)
    longest = handing.longest(2.0, slots, 1)
    assert slots / longest <= BUSY / PIECE, "pieces a second"
    seconds = CASE * active(10**9).size(longest, slots, handing)
    assert PIECE * slots <= seconds <= longest * (1 + 1e-9)
    if slots <= 2.0 * BUSY / PIECE:
        assert longest == 2.0, "few workers have the pieces they had"


def test_a_small_job_is_cut_as_before_for_few_workers_and_into_no_more_than_pays_for_many() -> None:
    for cases in (200, 1000, 5000, 100_000):
        assert active(cases).size(2.0, 2, Handing(each=PIECE / 2)) == active(cases).size(2.0, 2, Handing()), cases
    many, handing = 10_000, Handing(each=PIECE / 2)
    at, pieces = 0, 0
    while at < 100_000:
        at, pieces = at + active(100_000, at).size(handing.longest(2.0, many, 1), many, handing), pieces + 1
    assert pieces < 4 * math.sqrt(100_000 * CASE / PIECE), "P pieces end after P·cost + work/P"


def test_what_commits_and_pieces_cost_is_learnt_and_no_outage_counts_as_that() -> None:
    handing, fixed, each = Handing(), 0.01, 0.0004
    handing.took(1, fixed + each)
    assert handing.cost(1) == pytest.approx(2 * (fixed + each))
    for k in range(200):
        for pieces in (1, 1 + 10 * k % 90):
            handing.took(pieces, fixed + pieces * each)
    assert (handing.fixed, handing.each) == (pytest.approx(fixed), pytest.approx(each))
    assert handing.cost(1) == pytest.approx(2 * (fixed + each))
    assert handing.cost(100) == pytest.approx(2 * (fixed / 100 + each))
    handing.took(1, 1000.0)
    assert handing.cost(1) < 8 * (fixed + each)
    assert min(handing.fixed, handing.each) >= 0.0


def test_many_workers_have_short_pieces_where_many_are_handed_out_together() -> None:
    handing = Handing(0.016, 0.0004)
    alone, together = (handing.longest(2.0, 10_000, batch) for batch in (1, TOGETHER))
    assert together < alone / 20
    assert handing.longest(2.0, 1, TOGETHER) == handing.longest(2.0, 1, 1), "one worker has one at a time"


def test_ten_thousand_workers_have_their_fill_of_a_thousand_million_cases() -> None:
    """In the model of GROWTH.md: pieces of two seconds, as they were, leave nine tenths of them idle."""
    fleet = Fleet(workers=10_000, case=CASE, cut=PIECE / 2, land=PIECE / 2)
    grown, fixed = (simulated(cases, fleet, learns=learns) for cases, learns in ((10**9, True), (10**7, False)))
    assert grown.share > 0.45
    assert fixed.share < 0.1
    assert grown.pieces * PIECE < grown.seconds
    slow = Fleet(workers=10_000, case=CASE, cut=8e-3, land=8e-3)
    one, many = (simulated(10**9, fleet) for fleet in (slow, replace(slow, each=4e-4, together=TOGETHER)))
    assert one.share < 0.5 < 0.9 < many.share, "a hundred pieces in a commit"
    few = Fleet(workers=16, case=CASE, cut=PIECE / 2, land=PIECE / 2)
    assert all(simulated(10**6, few, learns=learns).share > 0.9 for learns in (True, False))


def test_all_workers_together_look_for_the_mark_of_a_stopped_job_no_oftener_than_a_store_can_bear() -> None:
    for slots in (1, 100, 1000, 10_000):
        pause = max(MARKER_SECONDS, look_pause(slots))
        assert slots / pause <= LOOKS_A_SECOND
        assert slots > 100 or pause == MARKER_SECONDS
