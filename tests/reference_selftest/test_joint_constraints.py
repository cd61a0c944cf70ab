"""Constraint rows, freedoms and biases equal the corresponding derivatives, for every joint type."""

from dataclasses import replace

import numpy as np
import pytest

from tests.reference.mechanics.joint_constraints import TYPES, constraint_picker, directions, free_picker, of
from tests.reference.mechanics.kinematics import State, closure, forward, measured
from tests.reference.mechanics.newton_euler_equations import motion_row
from tests.reference.mechanics.rotation import turned
from tests.reference.scenes.random_scenes import ALL_TYPES, covering, first, random_tree

SEEDS = range(3)


def two_bodies(kind: str, seed: int):
    """A free body and a second body on the joint under test, at a random state."""
    case = random_tree(1000 + seed, 1, types=("free",), friction=0, devices=0, drives=0, loads=False)
    other = random_tree(2000 + seed, 2, types=(kind,), friction=0, devices=0, drives=0, loads=False)
    joint = other.scene.joints["j2"]
    parts = {"b1": case.scene.bodies["b1"], "b2": other.scene.bodies["b2"]}
    sides = {}
    for which in ("inboard", "outboard"):
        side = getattr(joint, which)
        text = side if isinstance(side, str) else side.body
        new = "b2" + text[2:] if text.startswith("b2") else "b1" + (text.partition(".")[1] + text.partition(".")[2])
        sides[which] = new if isinstance(side, str) else replace(side, body=new)
    scene = replace(case.scene, bodies=parts, joints={"j1": case.scene.joints["j1"], "j2": replace(joint, **sides)})
    q, qd = {"j1": case.q["j1"], "j2": other.q["j2"]}, {"j1": case.qd["j1"], "j2": other.qd["j2"]}
    return forward(scene, q, qd)


def moved(state: State, velocity: np.ndarray, acceleration: np.ndarray, h: float) -> State:
    """The state after a time h of motion with these velocities and accelerations of all bodies (second order)."""
    new = forward(state.scene, {n: state.q[n] for n in state.walked}, {})
    for i, body in enumerate(state.parts):
        v, w = velocity[6 * i : 6 * i + 3], velocity[6 * i + 3 : 6 * i + 6]
        a, alpha = acceleration[6 * i : 6 * i + 3], acceleration[6 * i + 3 : 6 * i + 6]
        R = turned(state.R[body], h * w + h * h / 2 * alpha)
        c = state.c[body] + h * v + h * h / 2 * a
        arm = R @ state.part(body).center
        new.put(body, R, c - arm, v + h * a - np.cross(w + h * alpha, arm), w + h * alpha)
    return new


@pytest.mark.default_cases(22)
@pytest.mark.parametrize("kind", ALL_TYPES)
@pytest.mark.parametrize("seed", SEEDS)
def test_position_constraints_change_at_the_rate_of_their_rows(kind, seed):
    state = two_bodies(kind, seed)
    index = {b: i for i, b in enumerate(state.parts)}
    held = directions(state, "j2").pick(constraint_picker(state.scene.joints["j2"]))
    rng, h = np.random.default_rng(seed), 1e-5
    u = rng.normal(size=12)
    plus, minus = (closure(moved(state, u, np.zeros(12), x), "j2")[0] for x in (h, -h))
    rows = [motion_row(state, "j2", F, T, index) @ u for F, T in zip(held.F, held.T, strict=True)]
    assert np.allclose((plus - minus) / (2 * h), rows, atol=1e-8)


@pytest.mark.default_cases(23)
@pytest.mark.parametrize("kind", ALL_TYPES)
@pytest.mark.parametrize("seed", SEEDS)
def test_rates_change_at_the_rate_of_rows_and_bias(kind, seed):
    state = two_bodies(kind, seed)
    index = {b: i for i, b in enumerate(state.parts)}
    rng, h = np.random.default_rng(seed), 1e-5
    u, a = rng.normal(size=(2, 12))
    here = directions(moved(state, u, a, 0.0), "j2")
    plus, minus = (directions(moved(state, u, a, x), "j2").rate for x in (h, -h))
    rows = np.array([motion_row(state, "j2", F, T, index) for F, T in zip(here.F, here.T, strict=True)])
    assert np.allclose(rows @ u, here.rate, atol=1e-12)
    assert np.allclose((plus - minus) / (2 * h), rows @ a + here.bias, atol=1e-8)


@pytest.mark.default_cases(26)
@pytest.mark.parametrize("kind", ALL_TYPES)
@pytest.mark.parametrize("seed", SEEDS)
def test_walked_joints_are_closed_and_measure_as_given(kind, seed):
    case = random_tree(seed, 3, types=(kind,), friction=0, devices=0, drives=0)
    state = case.state()
    for name in state.walked:
        position, velocity = closure(state, name)
        q, qd = measured(state, name, near=case.q[name])
        assert np.max(np.abs([*position, *velocity]), initial=0) < 1e-12
        assert np.allclose(q, case.q[name], atol=1e-12)
        assert np.allclose(qd, case.qd[name], atol=1e-12)


def test_a_joint_type_without_a_reference_says_what_to_add():
    assert set(ALL_TYPES) <= set(TYPES), [str(of(k)) for k in ALL_TYPES]
    with pytest.raises(LookupError, match="add an entry to TYPES"):
        of("rack")


def test_adding_a_joint_type_changes_only_the_joints_that_become_one():
    """Random trees of two joint types and of three. A scene that does not use the third type is the same in both sets. In other
    scenes, all other joints keep their numbers."""
    same = changed = 0
    for seed in range(20):
        before, after = (random_tree(seed, 3, types=t).scene for t in (("revolute", "free"), ("revolute", "free", "planar")))
        became = {n for n, j in after.joints.items() if j.type == "planar"}
        assert before.bodies == after.bodies
        assert all(before.joints[n] == j for n, j in after.joints.items() if n not in became)
        same, changed = same + (before == after), changed + bool(became)
    assert same >= 3
    assert changed >= 3


def test_a_property_no_case_has_is_reported():
    with pytest.raises(LookupError, match="no random case among 400 has two grounds"):
        first("two grounds", lambda case: False, lambda seed: seed)
    with pytest.raises(LookupError, match="has moons"):
        covering({"stars": lambda case: True, "moons": lambda case: False}, lambda seed: seed)


def test_freedoms_and_constraints_make_six():
    for case in (random_tree(s, 4) for s in range(5)):
        for joint in case.scene.joints.values():
            assert len(free_picker(joint)) + len(constraint_picker(joint)) == 6
