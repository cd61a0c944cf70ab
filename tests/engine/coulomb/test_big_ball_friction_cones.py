"""Big, rough balls reach their friction cones repeatedly. The regularised law and Coulomb's law pass the cones alike. The motion
converges to Coulomb's motion."""

from __future__ import annotations

import numpy as np
import pytest

from tests.default_case_selection import slow
from tests.engine.checks.random_run_laws import CONE, broken_cone
from tests.engine.mechanisms.big_ball_bodies import big_balls
from tests.reference.scenes.random_friction_scenes import rubbing
from tests.reference.states_from_columns import wanted
from tests.stability.entries.self_tightening_brakes import GRIPS, LEAVES, loosened, tightened
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

STARTS_ELSEWHERE = (3, 19, 24, 29)
"""Seeds of two balls in which sliding does not start at the point where the turning about the contact ends."""


def places(r: Result) -> np.ndarray:
    """Mass centres of all bodies at the end, m."""
    return np.array([r[f"{b}.position[{k}]"][-1] for b in r.scene.bodies for k in (1, 2, 3)])


def converges(count: int, seed: int) -> None:
    """Check that the regularised law passes all cones, and that its motion differs from Coulomb's motion to first order in
    v_eps."""
    exact = simulate(big_balls(count, seed, "coulomb"), until=1.0, every=1.0, rtol=1e-9)
    assert exact.outcome.ok
    off = []
    for v_eps in (1e-4, 1e-6):
        r = simulate(big_balls(count, seed, "regularized", v_eps), until=1.0, every=1.0, rtol=1e-9)
        assert r.outcome.ok
        off.append(np.abs(places(r) - places(exact)).max())
    # the difference is of first order in v_eps; rtol 1e-9 leaves an error of 1e-6 m
    assert off[1] <= max(0.05 * off[0], 1e-6 * count)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(12))
def test_big_balls_pass_their_friction_cone_under_the_regularised_law_and_converge_to_coulombs(seed: int) -> None:
    converges(1, seed)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", STARTS_ELSEWHERE)
def test_two_big_balls_pass_their_cones_and_converge_to_coulombs(seed: int) -> None:
    converges(2, seed)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("setting", [("auto", 1e-6), ("rk5", 1e-5), ("rosenbrock", 1e-6), ("rk8", 1e-8)])
def test_friction_is_followed_where_it_has_several_roots(setting: tuple[str, float]) -> None:
    """Two balls reach their cones at 0.262 s. Friction has four roots at this time, but only one root a moment later. The engine
    finds and keeps this root."""
    method, rtol = setting
    r = simulate(big_balls(2, 42, "coulomb"), until=1.0, every=1.0, method=method, rtol=rtol, outputs=["energy.*"])
    assert r.outcome.ok
    assert np.abs(r["energy.residual"]).max() <= 100.0 * rtol * r["energy.dissipated"][-1]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("method", "kernel"), [
    ("auto", "compiled"), ("rosenbrock", "compiled"), ("rosenbrock", "parts"),
    slow(("rk8", "compiled")), slow(("auto", "parts")), slow(("rk8", "parts")),  # these settings take half a minute each
])  # fmt: skip
@pytest.mark.slow
def test_rows_at_which_a_ball_leaves_its_cone_are_within_it(method: str, kernel: str) -> None:
    """From 0.04685 s on, a ball of this loop alternates between its branches up to a thousand times. In the row at the end of a
    branch, friction follows from the ending branch."""
    scene = rubbing("loop", 247).scene
    r = simulate(scene, until=0.046856, every=0, method=method, rtol=1e-6, outputs=wanted(scene), kernel=kernel)
    assert r.outcome.ok
    assert broken_cone(r, 1e-6, since=0.04685) <= CONE


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", [*STARTS_ELSEWHERE, 38])
def test_a_ball_at_whose_kink_no_sliding_starts_leaps_to_where_it_does(seed: int) -> None:
    """If the ball started to slide at the kink, sliding would take it back below the kink. The engine must not pass the kink again
    and again."""
    exact = simulate(big_balls(2, seed, "coulomb"), until=1.0, every=1.0, rtol=1e-6)
    for v_eps in (1e-4, 1e-5):
        r = simulate(big_balls(2, seed, "regularized", v_eps), until=1.0, every=1.0, rtol=1e-6, max_steps=10000)
        assert r.outcome.ok
        assert r.stats.steps <= 2 * exact.stats.steps
        assert any(e.kind == "fold" for e in r.events)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("law", ["coulomb", "regularized"])
@pytest.mark.parametrize("turned", [tightened, loosened])
def test_a_ball_whose_branch_folds_away_reports_one_fold_by_every_method_and_tolerance(turned, law: str) -> None:
    """A brake well beyond its thresholds. At a time with a closed form, forces jump and velocities are continuous."""
    scene = turned(0.3, law)
    until = float(scene.simulation.until)
    share = (1.0 - 0.5) / (1.3 - 0.5) if turned is tightened else (1.2 * LEAVES - GRIPS) / (1.2 * LEAVES - 0.7 * GRIPS)
    for method in ("auto", "rk5", "rk8", "rosenbrock"):
        for rtol in (1e-5, 1e-7, 1e-9):
            r = simulate(scene, until=until, every=until, rtol=rtol, method=method)
            assert r.outcome.ok
            assert [(e.kind, e.joint) for e in r.events] == [("fold", "ball")]
            assert r.events[0].time / until == pytest.approx(share, abs=100 * rtol)
