"""Energy changes by exactly the power of friction, drives, dampers and loads. Friction never adds energy."""

import numpy as np
import pytest

from tests.reference import forward, solve
from tests.reference.dynamics import Result
from tests.reference.mechanics.joint_constraints import of
from tests.reference.mechanics.loads_and_devices import Applied, kinetic_energy
from tests.reference.mechanics.rotation import matrix_from_quaternion, quaternion_from_matrix, turned
from tests.reference.scenes.random_scenes import ALL_TYPES, Case, random_loop, random_tree


def later(case: Case, result: Result, h: float) -> float:
    """Energy after a time h, in which the tree joints move with their accelerations."""
    q, qd = {}, {}
    for name in case.tree:
        kind, a = case.scene.joints[name].type, result.qdd[name]
        step = h * case.qd[name] + h * h / 2 * a
        qd[name] = case.qd[name] + h * a
        k = of(kind).scalars
        if not of(kind).ball:
            q[name] = case.q[name] + step
        else:
            ball = quaternion_from_matrix(turned(matrix_from_quaternion(case.q[name][k:]), step[k:]))
            q[name] = np.r_[case.q[name][:k] + step[:k], ball]
    state = forward(case.scene, q, qd, case.t + h)
    for name in state.loops:
        state.q[name] = case.q[name] + h * case.qd[name] if len(case.q[name]) == len(case.qd[name]) else case.q[name]
    applied = Applied(state)
    for name in case.scene.joints:
        applied.devices(name)
    return kinetic_energy(state) + sum(applied.stored.values())


def check(case: Case) -> None:
    result = solve(case.state())
    h = 1e-5
    change = (later(case, result, h) - later(case, result, -h)) / (2 * h)
    scale = 1.0 + result.kinetic + sum(abs(p) for p in result.power.values())
    assert change == pytest.approx(sum(result.power.values()), abs=2e-6 * scale)
    assert result.power["friction"] <= 0.0
    assert result.power["dampers"] <= 0.0
    assert result.inconsistency < 1e-9
    for name, friction in result.friction.items():
        if case.scene.joints[name].type not in ("spherical", "cylindrical"):
            assert np.all(friction * case.qd[name] >= -1e-12)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("kind", ALL_TYPES)
def test_power_balance_of_every_joint_type(kind):
    for seed in range(4):
        check(random_tree(seed, 3, types=(kind, kind, kind, "revolute"), friction=0.8, t=0.3))


@pytest.mark.default_cases(13)
@pytest.mark.parametrize("seed", range(15))
def test_power_balance_of_mixed_trees(seed):
    check(random_tree(3000 + seed, t=0.25))


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(8))
def test_power_balance_of_loops(seed):
    check(random_loop(seed, loops=1 + seed % 2, t=0.2))
