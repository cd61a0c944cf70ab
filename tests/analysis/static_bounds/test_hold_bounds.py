"""Bounds at rest, compared with hand calculations for five mechanisms and with sampled states that the kernel's laws admit. The
single state of ``hold`` without bounds lies within the bounds."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import trunnion
from tests.analysis.static_bounds import hand_calculation_scenes as scenes
from trunnion.analysis.static_bounds.bounds_results import LoadBounds
from trunnion.analysis.static_bounds.elementary_motions import motions
from trunnion.analysis.static_bounds.equilibrium_equations import Statics, statics
from trunnion.analysis.static_bounds.hold_check import CELLS
from trunnion.analysis.static_bounds.pair_and_load_bounds import admissible_states, load_bounds
from trunnion.analysis.static_bounds.search_budget import SearchBudget
from trunnion.scene.overrides import scene_given

CLOSED = 1e-8
"""Relative gap of closed bounds; searches close to 1e-9 of the loads."""


def sine(mu: float) -> float:
    return mu / math.hypot(1.0, mu)


def load_alone(scene: dict[str, Any], name: str, cells: int = CELLS, self_stress: float | None = None) -> LoadBounds:
    """The bounds of one load by ``trunnion.hold``. Bounds of all joints would take several times as long."""
    st = statics(scene_given(scene))
    drive = name in [load.name for load in st.drives]
    k = [load.name for load in (st.drives if drive else st.loads)].index(name)
    return load_bounds(st, tuple(st.pairs()), self_stress, SearchBudget(cells), k, drive)


@pytest.mark.slow
def test_a_load_asked_for_alone_is_that_of_all_bounds() -> None:
    for scene, name in ((scenes.four_bar(), "joints.d.effort"), (scenes.rod(), "forces.turn")):
        alone, found = load_alone(scene, name, 4), trunnion.hold(scene, bounds=True, cells=4).load(name)
        assert (alone.name, alone.unit, alone.now) == (found.name, found.unit, found.now)
        for mine, its in ((alone.more, found.more), (alone.less, found.less)):
            assert mine.guaranteed.certified == its.guaranteed.certified
            assert mine.possible.certified == its.possible.certified


def test_a_door_is_sure_to_hold_what_its_four_contacts_carry_with_the_longest_arms() -> None:
    """Radial loads f_i at heights ±s/2 ± c carry the moment M = W·arm. Σ|f| is at least M divided by the largest height, 2 M/(s +
    2c). Thrust friction acts on the whole weight. Couples inside the pins are arbitrary, so that no torque certainly turns the
    door."""
    moment = scenes.WEIGHT * scenes.ARM
    radial = 2.0 * moment / (scenes.SPACING + 2.0 * scenes.HALF)
    held = scenes.RADIUS * sine(scenes.MU) * radial + scenes.THRUST * scenes.MU * scenes.WEIGHT
    b = trunnion.hold(scenes.door(), bounds=True, cells=8)
    load = b.load("joints.low.effort")
    assert load.more.guaranteed.certified == pytest.approx(held, rel=CLOSED)
    assert load.more.guaranteed.value == pytest.approx(held, rel=CLOSED)
    assert load.less.guaranteed.value == pytest.approx(-held, rel=CLOSED)
    assert load.more.possible.value == math.inf
    assert load.more.possible.state is not None
    assert load.more.possible.state.endless
    assert b["low"].normal_force.largest.value == math.inf
    assert b.holds == "certain"
    assert load.more.joints == ("low", "high")


def test_a_door_without_self_stress_holds_as_with_four_equal_springs_at_its_contacts() -> None:
    """Four equal contacts at heights h_i: f_i = M h_i/Σh², Σ|f| = 2 M s/(s² + 4c²)."""
    s, c = scenes.SPACING, scenes.HALF
    radial = 2.0 * scenes.WEIGHT * scenes.ARM * s / (s * s + 4.0 * c * c)
    held = scenes.RADIUS * sine(scenes.MU) * radial + scenes.THRUST * scenes.MU * scenes.WEIGHT
    load = load_alone(scenes.door(), "joints.low.effort", 60, self_stress=0.0)
    assert load.more.guaranteed.certified == pytest.approx(held, rel=CLOSED)
    assert load.more.possible.certified == pytest.approx(held, rel=CLOSED)


def test_a_block_between_walls_is_sure_to_hold_its_weights_friction_and_may_hold_anything() -> None:
    """The forces at the ends sum to at least the weight. Walls that press against each other have unlimited self-stress."""
    load = load_alone(scenes.walls(), "forces.push", 8)
    assert load.more.guaranteed.value == pytest.approx(0.2 * 50.0, rel=CLOSED)
    assert load.more.possible.value == math.inf


def test_a_four_bar_rests_while_lines_of_force_keep_within_its_friction_circles() -> None:
    """The coupler pulls with T along its line, at distances h from the pins. The pins' reactions stay within circles ρ = r sin φ
    about the pins. The torque is T (h_a ± ρ_a) about pin a, and T (h_d ± ρ_d) about pin d."""
    torque, held = 4.5, 13.5
    rho_a, rho_d = 0.01 * sine(0.2), 0.012 * sine(0.3)
    h_a, h_d = 0.1 * 0.4 / math.hypot(0.4, 0.2), 0.3 * 0.4 / math.hypot(0.4, 0.2)
    pull = max(held / (h_d + rho_d), torque / (h_a + rho_a)), min(held / (h_d - rho_d), torque / (h_a - rho_a))
    b = trunnion.hold(scenes.four_bar(), bounds=True)
    assert b.open == 1
    normal = b["a"].normal_force
    assert [normal.least.value, normal.largest.value] == pytest.approx([math.cos(math.atan(0.2)) * t for t in pull], rel=CLOSED)
    assert [normal.least.certified, normal.largest.certified] == pytest.approx(
        [normal.least.value, normal.largest.value], rel=CLOSED
    )
    friction = sorted((held - t * h_d) / 0.012 for t in pull)
    found = b["d"].friction
    assert sorted(abs(e.value or 0.0) for e in (found.least, found.largest)) == pytest.approx(
        sorted(map(abs, friction)), rel=CLOSED
    )
    load = b.load("joints.d.effort")
    ends = torque * (h_d - rho_d) / (h_a + rho_a), torque * (h_d + rho_d) / (h_a - rho_a)
    assert [load.less.possible.value, load.more.possible.value] == pytest.approx(ends, rel=CLOSED)
    assert [load.less.guaranteed.value, load.more.guaranteed.value] == pytest.approx(ends, rel=CLOSED)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("height", "held"), [(0.15, 4.0), (0.29, 4.0), (0.31, math.inf)])
def test_a_guide_pushed_from_high_enough_locks_itself(height: float, held: float) -> None:
    """The guide's ends press with max(W, P h/c). The guide holds P ≤ μ W, and any P where μ h/c ≥ 1 (h = 0.3 m)."""
    load = load_alone(scenes.guide(height), "forces.push")
    assert load.more.guaranteed.certified == pytest.approx(held, rel=CLOSED)
    assert load.more.possible.certified == pytest.approx(held, rel=CLOSED)


def test_a_beam_on_three_supports_certainly_holds_the_load_that_its_smoothest_supports_hold() -> None:
    """The reference is the least Σ μ_i |f| over all forces at the ends of the guides with Σ f = W and Σ x f = 1.2 m W. Most of the
    load is on the smoothest guide, at x = 0.05 and 2.05 m, 0.425·0.1 + 0.575·0.2 of W. Guides that press against each other hold
    any push."""
    load = load_alone(scenes.beam(), "joints.s0.effort", 8)
    assert load.more.guaranteed.value == pytest.approx(15.75, rel=1e-6)  # friction has an arm of 1e-6 m
    assert load.more.guaranteed.certified == pytest.approx(15.75, rel=1e-6)
    assert load.more.possible.value == math.inf


def test_a_rod_that_hangs_from_a_ball_holds_the_torque_of_its_friction_either_way() -> None:
    """The ball carries W and holds r W sin φ. The offset of the mass centre takes W·offset of this torque."""
    load = load_alone(scenes.rod(), "forces.turn")
    held, lean = 0.01 * 20.0 * sine(0.2), 20.0 * 1e-3
    ends = [load.less.guaranteed, load.less.possible, load.more.guaranteed, load.more.possible]
    assert [e.certified for e in ends] == pytest.approx([-held - lean] * 2 + [held - lean] * 2, rel=CLOSED)


def test_a_rod_that_slips_without_further_load_has_no_guaranteed_load() -> None:
    b = trunnion.hold(scenes.rod(torque=0.1), bounds=True)
    assert b.holds == "no"
    assert math.isnan(b.load("forces.turn").more.guaranteed.certified)
    assert b.load("forces.turn").more.possible.certified < 0.1


def sampled(st: Statics, rng: np.random.Generator, n: int) -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Random states in equilibrium that the kernel's laws admit: (capacities, friction over capacity, signed friction)."""
    a = admissible_states(st, tuple(st.pairs()), None, SearchBudget(5))
    caps, shares, sizes = [], [], []
    for _ in range(n):
        X = np.append(rng.normal(0.0, 10.0 ** rng.uniform(-3, 0), a.space.open), 1.0)
        x = a.space.x(X)
        held = st.probe.capacities(a.space.reactions(x), x[st.eta0 : st.multipliers])
        if (held[:, 1] <= held[:, 0]).all():
            caps.append(held[:, 0])
            shares.append(held[:, 1] / held[:, 0])
            sizes.append(held[:, 1])
    return caps, shares, sizes


@pytest.mark.slow
def test_states_that_the_kernels_laws_admit_lie_inside_the_bounds() -> None:
    scene = scene_given(scenes.four_bar(cross=True))
    b = trunnion.hold(scene, bounds=True, cells=1)
    assert b.open == 3
    caps, shares, sizes = sampled(statics(scene), np.random.default_rng(1), 4000)
    assert len(caps) > 100
    for cap, share, size in zip(caps, shares, sizes, strict=True):
        for k, p in enumerate(b.pairs):
            mu = {"a": 0.2, "b": 0.25, "d": 0.3}[p.joint]
            assert p.normal_force.contains(cap[k] / mu)
            assert p.share.contains(share[k])
            assert p.friction.contains(size[k]) or p.friction.contains(-size[k])


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("make", [scenes.door, scenes.walls, lambda: scenes.four_bar(cross=True)])
def test_capacities_of_pairs_equal_those_of_the_kernel_for_any_reaction(make: Callable[[], dict[str, Any]]) -> None:
    st = statics(scene_given(make()))
    rng = np.random.default_rng(3)
    for _ in range(20):
        N, eta = rng.normal(size=len(st.reaction)), rng.normal(size=st.system.neta)
        held = st.probe.capacities(N, eta)
        for k, p in enumerate(st.pairs()):
            mine, sense = N[st.joint(p.joint).reactions], np.sign(eta[p.eta[0]])
            norms = next(c for c in p.capacities if c.sense * sense >= 0.0).norms
            assert sum(n.weight * np.linalg.norm(n.rows @ mine) for n in norms) == pytest.approx(held[k, 0], rel=1e-12)
            assert np.linalg.norm(p.friction @ eta[list(p.eta)]) == pytest.approx(held[k, 1], rel=1e-12)


@pytest.mark.slow
def test_the_single_state_lies_inside_the_bounds() -> None:
    rng = np.random.default_rng(5)
    held = 0
    for _ in range(2):
        pull, mu = rng.uniform(5.0, 60.0), rng.uniform(0.1, 0.6)
        scene = scenes.four_bar(held=pull * 0.2683, torque=-pull * 0.0894 * rng.uniform(0.97, 1.03), mu=mu)
        b = trunnion.hold(scene, bounds=True, cells=3)
        if not b.answer.holds:
            continue
        held += 1
        assert b.holds in ("certain", "possible")
        for p in b.answer.pairs:
            assert b[p.joint].share.contains(p.share)
            assert b[p.joint].normal_force.contains(p.capacity / (mu if p.joint == "a" else 0.3))
    assert held


def test_a_mechanism_of_two_freedoms_lets_go_in_one_of_two_motions() -> None:
    """Two doors in a row on the ground. Each door may turn while the other door rests."""
    scene = scenes.door()
    scene["bodies"]["gate"] = {"mass": 3.0, "inertia": [1, 1, 1], "center": [0.2, 0, 0], "points": {"p": [0, 0, 0]}}
    scene["joints"]["own"] = scene["joints"]["high"] | {"inboard": "ground", "outboard": "gate.p", "start": {"q": 0}}
    st = statics(scene_given(scene))
    ps = tuple(st.pairs())
    found = motions(st, ps)[0]
    assert sorted(tuple(ps[i].joint for i in m.moving) for m in found) == [("low", "high"), ("own",)]


def test_all_wrong_settings_of_bounds_are_reported_at_once() -> None:
    with pytest.raises(trunnion.SceneError, match=r"(?s)self_stress.*budget"):
        trunnion.hold(scenes.guide(0.1), bounds=True, self_stress=-1.0, budget=0.0)
