"""Events whose margin is smaller than the error of the run are marked as marginal. Other events have no mark. Every table shows the
mark."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.engine.checks.random_run_laws import time_scale
from tests.reference.scenes.random_friction_scenes import rubbing
from tests.stability.entries.doors_and_marginal_stop import settling
from tests.stability.entries.rest_and_dead_centres import ratchet
from trunnion.simulation.results.csv_and_parquet import load_result_table
from trunnion.simulation.run import simulate

METHODS = ("rk5", "rk8", "rosenbrock")
TOLERANCES = (1e-5, 1e-7, 1e-9)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("method", METHODS)
def test_a_stop_on_its_edge_is_marginal_where_its_margin_is_below_the_runs_own_error(method: str) -> None:
    """A block on a spring comes to rest where the spring pulls with (1 + 3 beyond) times the static friction."""
    for beyond in (-1e-1, -1e-5, 1e-5, 1e-1):
        for rtol in TOLERANCES:
            (event,) = simulate(settling(beyond), every=1.0, method=method, rtol=rtol).events
            assert event.kind == ("stick" if beyond < 0.0 else "reversal") or event.marginal
            assert event.margin > 0.1 if abs(beyond) > 1e-2 else event.margin == pytest.approx(3.0 * abs(beyond), abs=10.0 * rtol)
            assert event.marginal == (abs(beyond) == 1e-5 and rtol == 1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_a_release_by_a_load_that_just_reaches_static_friction_is_marginal(method: str) -> None:
    """The largest load is 1 + beyond times the static friction. The margin comes from a parabola through a long step."""
    for beyond, rtol, marginal in ((1e-7, 1e-5, True), (1e-7, 1e-9, False), (1e-1, 1e-5, False), (1e-1, 1e-9, False)):
        first = simulate(ratchet(beyond), until=1.0, every=1.0, method=method, rtol=rtol).events[0]
        assert (first.kind, first.marginal) == ("slip", marginal)


def test_a_marginal_event_has_a_note_and_a_column_in_every_table(tmp_path: Path) -> None:
    scene = settling(1e-7)
    r = simulate(scene, every=0.01, rtol=1e-5, outputs=["events.*"])
    clear = simulate(settling(0.1), every=0.01, rtol=1e-5, outputs=["events.*"])
    assert "marginal" in r.notes[-1]
    assert r["events.last.marginal"][-1] == 1.0
    assert not any("marginal" in note for note in clear.notes)
    assert clear["events.last.marginal"][-1] == 0.0
    for suffix in ("csv", "parquet"):
        r.save(tmp_path / f"r.{suffix}")
        assert load_result_table(tmp_path / f"r.{suffix}").events == r.events


def test_steps_of_impulses_know_no_margin() -> None:
    r = simulate(settling(1e-7), every=0.01, rtol=1e-5, method="moreau")
    assert r.events
    assert all(e.margin != e.margin and not e.marginal for e in r.events)


@pytest.mark.parametrize(("seed", "marginal"), [(24, False), (58, True)])
def test_the_margin_of_a_sliding_pair_beside_others_that_hold_is_found_by_holding_it(seed: int, marginal: bool) -> None:
    """Other pairs that hold take part of the load of a sliding pair. An estimate that ignores these pairs gives too small a margin.
    In loop 58 the margin is 5e-5."""
    case = rubbing("loop", seed)
    until = 3.0 * time_scale(case)
    r = simulate(case.scene, until=until, every=until, method="rk8", rtol=1e-4, outputs=["energy.kinetic"])
    assert any(e.marginal for e in r.events) == marginal
