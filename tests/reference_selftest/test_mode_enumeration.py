"""The search for all continuations from rest agrees with hand calculations: thresholds, blocks on blocks, cases with two solutions,
and cases in which friction wedges and no solution exists."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.reference import closure, forward
from tests.reference.contact_and_friction.joint_friction import Rubbing
from tests.reference.contact_and_friction.mode_enumeration import Decision
from tests.reference.contact_and_friction.sliding_closed_forms import sliding_pairs
from tests.reference.mechanics.newton_euler_equations import Equations
from tests.reference.scenes.paper_examples import double_pendulum
from tests.reference.scenes.random_friction_scenes import rubbing
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm

CASES = Path(__file__).parents[1] / "engine" / "stick_slip" / "hard_scenes"
PUSHED = {
    0.0: ("sticks", "sticks"),
    0.99: ("sticks", "sticks"),
    1.01: ("sticks", "+"),
    -1.01: ("sticks", "-"),
}


@pytest.mark.parametrize("seed", range(12))
def test_friction_in_plain_numbers_is_that_of_the_contacts_found_as_roots(seed: int) -> None:
    state = rubbing("tree", seed).state()
    eq = Equations(state)
    pairs, unit = sliding_pairs(eq), np.ones(len(eq.eta))
    for p in pairs:
        unit[list(p.places)] = np.abs(p.load[:3, 0]).max() * np.array(p.arms)
    x = np.r_[1.0, 0.3 * unit * np.random.default_rng(seed).normal(size=len(unit))]
    for p in pairs:
        exact = Rubbing(state, p.joint).friction(eq.press(p.joint) @ x, eq.devices(p.joint) @ x)[0][list(p.freedoms)]
        got = p.friction([state.qd[p.joint][k] for k in p.freedoms], p.mu, x)
        assert got == pytest.approx(exact, rel=1e-11, abs=1e-12 * np.abs(exact).max())


def modes(scene: sm.Scene, **coordinates) -> list[dict[str, str]]:
    """Results of the search for a scene at rest at these coordinates."""
    return [a.modes for a in Decision(forward(scene, coordinates)).answers()]


def block(**friction) -> tuple[sm.Body, sm.Friction]:
    """A block and its long guide, which is so narrow that only the weight loads it."""
    return sm.Body(mass=2.0, inertia=(0.1, 0.1, 0.1)), sm.Friction(half_width=1e-3, half_height=1e-3, half_length=0.5, **friction)


def incline(tilt: float, **friction) -> sm.Scene:
    """A block on an incline."""
    body, rub = block(**friction)
    slide = sm.Joint("prismatic", "ground", "block", axis="x", pin="outboard", friction=rub)
    return sm.Scene({"block": body}, {"slide": slide}, gravity=(9.81 * math.sin(tilt), 0.0, -9.81 * math.cos(tilt)))


@pytest.mark.parametrize(("ratio", "answer"), [(1 - 1e-6, ["sticks"]), (1 + 1e-6, ["+"])])
def test_a_block_on_an_incline_starts_to_slide_where_the_tangent_exceeds_its_coefficient(ratio: float, answer: list[str]) -> None:
    assert modes(incline(math.atan(0.3 * ratio), mu=0.3), slide=[0.0]) == [{"slide.1": a} for a in answer]


def test_between_sliding_and_static_friction_a_block_may_do_either() -> None:
    assert modes(incline(math.atan(0.4), mu=0.3, mu_static=0.45), slide=[0.0]) == [{"slide.1": "sticks"}, {"slide.1": "+"}]


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("push", PUSHED)
def test_the_upper_of_two_blocks_slips_alone_or_takes_the_lower_along(push: float) -> None:
    """A push on the upper block, in units of its static friction. The ground carries twice the weight with the same coefficient, so
    the lower block never moves."""
    body, rub = block(mu=0.4)
    on = 0.4 * 2.0 * 9.81 * push
    joints = {
        "lower": sm.Joint("prismatic", "ground", "a", axis="x", friction=rub),
        "upper": sm.Joint("prismatic", "a", "b", axis="x", friction=rub, effort=on),
    }
    scene = sm.Scene({"a": body, "b": body}, joints, gravity=(0.0, 0.0, -9.81))
    lower, upper = PUSHED[push]
    assert modes(scene, lower=[0.0], upper=[0.0]) == [{"lower.1": lower, "upper.1": upper}]


def test_a_ball_at_rest_slides_or_turns_about_its_contact_but_holds_only_what_hangs_straight() -> None:
    """The ball holds a load whose line passes beside the pivot by less than the radius times the sine of the friction angle.
    Slightly beyond this distance, the ball slides."""
    radius, mu = 0.05, 0.6
    edge = radius * mu / math.sqrt(1 + mu**2)
    for share, answer in ((0.0, "sticks"), (0.999, "sticks"), (1.001, "slides")):
        body = sm.Body(mass=1.0, inertia=(0.1, 0.1, 0.1), center=(share * edge, 0.0, -0.4))
        joint = sm.Joint("spherical", "ground", "body", friction=sm.Friction(mu=mu, radius=radius))
        scene = sm.Scene({"body": body}, {"ball": joint}, gravity=(0.0, 0.0, -9.81))
        assert modes(scene, ball=[1.0, 0.0, 0.0, 0.0]) == [{"ball.1": answer}]


@pytest.mark.slow
def test_both_solutions_are_found_where_all_pairs_stick_or_all_slip() -> None:
    scene = load_scene(str(CASES / "two_initial_solutions.yaml"))
    starts = {n: j.start.q for n, j in scene.joints.items() if j.start is not None and n != "jc"}
    found = Decision(forward(scene, starts), starts=3).motions()
    assert [set(a.modes.values()) for a in found] == [{"sticks"}, {"+", "-"}]


def test_a_crank_that_passes_its_dead_centre_has_one_answer() -> None:
    """The guide slides back as the crank requires. The second axis of the universal joint is at rest."""
    scene = load_scene(str(CASES / "universal_at_dead_centre.yaml"))
    drive = sm.Drive(constant=sm.Constant(10.0, math.pi))
    scene = replace(scene, joints=scene.joints | {"p": replace(scene.joints["p"], drive=drive)})
    q = {"p": [math.pi], "s": [0.0, 0.0, 1.0, 0.0], "k": [0.0, 0.0]}  # the crank points backwards, and the rod lies along the guide
    state = forward(scene, q, {"p": [10.0], "s": [0.0, 5.0, 0.0], "k": [-5.0, 0.0]})
    assert np.abs(np.concatenate(closure(state, "g"))).max() < 1e-14
    assert [a.modes for a in Decision(state).answers()] == [{"k.2": "sticks", "g.1": "slides"}]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("half", "answers"), [(0.3, 1), (0.15, 0)])
def test_a_guide_too_short_for_the_load_beside_it_has_no_answer(half: float, answers: int) -> None:
    """Example 8.3 at its start: the load acts at 0.60 m, beyond c/μ = 0.5 m for c = 0.15 m (theory, "Errata of the paper")."""
    start = {"shaft": [0.0, 0.0], "cross": [0.0, 0.0]}, {"shaft": [10.0, 0.0], "cross": [0.0, 0.0]}
    found = Decision(forward(double_pendulum(c=half, law="coulomb"), *start)).answers()
    assert len(found) == answers
    assert all(set(a.modes.values()) <= {"+", "-"} for a in found)
