"""Bounds of the change of contact forces that friction can cause. No admissible state lies beyond the bounds, and searches begin
within them."""

from __future__ import annotations

import numpy as np
import pytest

from tests.analysis.static_bounds import hand_calculation_scenes as scenes
from trunnion.analysis.static_bounds.equilibrium_equations import statics
from trunnion.analysis.static_bounds.equilibrium_space import holding_program, space
from trunnion.analysis.static_bounds.norm_upper_bounds import norm_bounds
from trunnion.analysis.static_bounds.pair_and_load_bounds import admissible_states, pair_bounds
from trunnion.analysis.static_bounds.search_budget import SearchBudget
from trunnion.analysis.static_bounds.slip_onset_and_self_stress import limit_self_stress
from trunnion.scene.overrides import scene_given

CLOSED = 1e-8
"""Relative gap of closed bounds; searches close to 1e-9 of the loads."""


@pytest.mark.slow
def test_no_admissible_state_has_a_norm_beyond_its_bound_by_friction() -> None:
    """Random states that the kernel's laws admit, with friction up to five times as large as in the other scenes."""
    for scene in (scenes.four_bar(cross=True), scenes.four_bar(ball=True), scenes.four_bar(mu=1.0)):
        st = statics(scene_given(scene))
        s = space(st, tuple(st.pairs()))
        program, sizes, holds = holding_program(s)
        reach = [(j, -row.linear[-1]) for row in norm_bounds(program, sizes, holds, {}) for j in row.norms]
        assert len(reach) == sum(len(by) for made in holds for by in made.values())
        rng, seen = np.random.default_rng(7), 0
        for _ in range(3000):
            X = np.append(rng.normal(0.0, 10.0 ** rng.uniform(-3, 0), s.open), 1.0)
            held = st.probe.capacities(s.reactions(s.x(X)), s.x(X)[st.eta0 : st.multipliers])
            if (held[:, 1] <= held[:, 0]).all():
                seen += 1
                assert all(np.linalg.norm(program.terms[j] @ X) <= most for j, most in reach)
        assert seen > 30


def test_forces_that_self_stress_leaves_open_are_unbounded_until_it_is_limited() -> None:
    st = statics(scene_given(scenes.door()))
    s = space(st, tuple(st.pairs()))
    program, sizes, holds = holding_program(s)
    assert norm_bounds(program, sizes, holds, {}) == ()
    bounded, stress = limit_self_stress(s, program, 10.0)
    assert len(norm_bounds(bounded, sizes, holds, stress)) == len(stress) - len(sizes)


@pytest.mark.slow
def test_three_open_directions_close_in_two_hundred_cells() -> None:
    st = statics(scene_given(scenes.four_bar(cross=True)))
    pairs = tuple(st.pairs())
    found = pair_bounds(admissible_states(st, pairs, None, SearchBudget(200)), [p.joint for p in pairs].index("d"))
    for interval in (found.normal_force, found.share):
        assert interval.least.gap <= CLOSED * abs(interval.least.certified)
        assert interval.largest.gap <= CLOSED * abs(interval.largest.certified)


def test_a_loop_with_a_ball_that_nothing_holds_is_reported_at_once() -> None:
    """The coupler pulls with held/h_d = 60 N. Friction changes the crank's torque of 4.5 N m by at most 0.15 N m."""
    st = statics(scene_given(scenes.four_bar(ball=True, held=16.0)))
    assert admissible_states(st, tuple(st.pairs()), None, SearchBudget(1)).there is False


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_a_search_attains_what_it_certifies_where_ten_directions_are_open(seed: int) -> None:
    """Self-stress loads every pin of a press to its capacity. A relaxation without all tangents is not exact."""
    mu = np.random.default_rng(seed).uniform(0.05, 0.4, 4)
    pins = {f"joints.{j}.friction.mu": float(x) for j, x in zip(("head", "knee_upper", "knee_lower", "wrist"), mu, strict=True)}
    st = statics(scene_given("toggle_press", pins))
    pairs = tuple(st.pairs())
    states = admissible_states(st, pairs, None, SearchBudget(100))
    for i in (1, 2):
        largest = pair_bounds(states, i).share.largest
        assert largest.certified == pytest.approx(1.0, abs=1e-9)
        assert largest.value == pytest.approx(1.0, abs=1e-6)
