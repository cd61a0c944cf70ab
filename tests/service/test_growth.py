"""However many workers there are, one server can hand out what they ask for, and one store answer them."""

from __future__ import annotations

import math

import pytest

from service.executor.active import Active
from service.executor.sizing import BUSY, LOOKS_A_SECOND, Handing, look_pause
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
    handing = Handing(PIECE)
    longest = handing.longest(2.0, slots)
    assert slots / longest <= BUSY / PIECE, "pieces a second"
    seconds = CASE * active(10**9).size(longest, slots, handing)
    assert PIECE * slots <= seconds <= longest * (1 + 1e-9)
    if slots <= 2.0 * BUSY / PIECE:
        assert longest == 2.0, "few workers have the pieces they had"


def test_a_small_job_is_cut_as_before_for_few_workers_and_into_no_more_than_pays_for_many() -> None:
    for cases in (200, 1000, 5000, 100_000):
        assert active(cases).size(2.0, 2, Handing(PIECE)) == active(cases).size(2.0, 2, Handing()), cases
    many, handing = 10_000, Handing(PIECE)
    at, pieces = 0, 0
    while at < 100_000:
        at, pieces = at + active(100_000, at).size(handing.longest(2.0, many), many, handing), pieces + 1
    assert pieces < 4 * math.sqrt(100_000 * CASE / PIECE), "P pieces end after P·cost + work/P"


def test_what_a_piece_costs_is_learnt_and_no_outage_counts_as_that() -> None:
    handing = Handing()
    for _ in range(200):
        handing.turned(4, 4 * PIECE / 2)
    handing.turned(0, 10.0)
    assert handing.cost == pytest.approx(PIECE)
    handing.turned(1, 1000.0)
    assert handing.cost < 4 * PIECE


def test_ten_thousand_workers_have_their_fill_of_a_thousand_million_cases() -> None:
    """In the model of GROWTH.md: pieces of two seconds, as they were, leave nine tenths of them idle."""
    fleet = Fleet(workers=10_000, case=CASE, cut=PIECE / 2, land=PIECE / 2)
    grown, fixed = (simulated(cases, fleet, learns=learns) for cases, learns in ((10**9, True), (10**7, False)))
    assert grown.share > 0.45
    assert fixed.share < 0.1
    assert grown.pieces * PIECE < grown.seconds
    few = Fleet(workers=16, case=CASE, cut=PIECE / 2, land=PIECE / 2)
    assert all(simulated(10**6, few, learns=learns).share > 0.9 for learns in (True, False))


def test_all_workers_together_look_for_the_mark_of_a_stopped_job_no_oftener_than_a_store_can_bear() -> None:
    for slots in (1, 100, 1000, 10_000):
        pause = max(MARKER_SECONDS, look_pause(slots))
        assert slots / pause <= LOOKS_A_SECOND
        assert slots > 100 or pause == MARKER_SECONDS
