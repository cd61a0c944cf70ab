"""Explicit methods take steps at their stability limit in a stiff steady creep. The tests check the rows, and the note about this
limit."""

import math

import numpy as np
import pytest

import trunnion
from trunnion.scene import scene_from_dict

GRAVITY, LENGTH = 9.81, 0.2
SETTLED = 3e-5
"""Change of the load, relative to the weight: the pendulum swings since the start of the creep."""


def creeping_carrier(seed: int) -> tuple[trunnion.Scene, float, float]:
    """A block that creeps down a slope and carries a pendulum at rest.

    Returns the scene, the friction that balances block and pendulum, N, and the slope of friction over speed, N s/m.
    """
    rng = np.random.default_rng(seed)
    block, bob = rng.uniform(0.5, 2.0), rng.uniform(0.3, 1.0)
    mu, v_eps, lean = rng.uniform(0.2, 0.5), 10 ** rng.uniform(-4.0, -3.5), rng.uniform(0.05, 0.12)
    scene = scene_from_dict({
        "schema": 1, "gravity": [GRAVITY * math.sin(lean), 0, -GRAVITY * math.cos(lean)],
        "bodies": {
            "block": {"mass": block, "inertia": [0.01] * 3, "position": [0, 0, 0]},
            "bob": {"mass": bob, "inertia": [2e-3] * 3, "position": [0, 0, -LENGTH]},
        },
        "joints": {
            "guide": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "block", "at": [0, 0, 0],
                      "friction": {"law": "regularized", "mu": mu, "v_eps": v_eps, "half_width": 0.02, "half_height": 0.02,
                                   "half_length": 0.2}},
            "pivot": {"type": "revolute", "axis": "y", "inboard": "block", "outboard": "bob", "at": [0, 0, 0], "damping": 0.05,
                      "start": {"q": -lean}},
        },
        "simulation": {"until": 0.5, "every": 0.007},
    })  # fmt: skip
    mass = block + bob
    return scene, mass * GRAVITY * math.sin(lean), mu * mass * GRAVITY * math.cos(lean) / v_eps


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("method", ["rk5", "rk8"])
@pytest.mark.parametrize("seed", range(4))
def test_rows_of_a_steady_creep_balance_its_load_within_the_tolerance(seed: int, method: str) -> None:
    """Errors of forces stay within the tolerance times the weight, although friction multiplies errors of the speed by more than
    1e4. If only the states were within a tolerance of 1e-4, rows would be 40 % off."""
    scene, load, _ = creeping_carrier(seed)
    weight = GRAVITY * sum(body.mass for body in scene.bodies.values())
    implicit = trunnion.simulate(scene, method="rosenbrock", rtol=1e-9, outputs="guide.friction.force")["guide.friction.force"]
    for rtol in (1e-4, 1e-6):
        result = trunnion.simulate(scene, method=method, rtol=rtol, outputs="guide.friction.force")
        steady = result.time > 0.25
        assert np.abs(result["guide.friction.force"] - load)[steady].max() <= SETTLED * weight + rtol * weight
        assert np.abs(result["guide.friction.force"] - implicit)[steady].max() <= rtol * weight


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_a_note_says_that_stability_limits_the_steps_of_the_chosen_method(seed: int) -> None:
    scene, _, _ = creeping_carrier(seed)
    for method, stiff in (("rk5", True), ("rk8", True), ("auto", False), ("rosenbrock", False)):
        result = trunnion.simulate(scene, method=method, until=0.1, outputs="guide.q[1]")
        assert any(n.startswith("the motion is stiff: stability") for n in result.notes) == stiff, method
        assert stiff or result.stats.counters["stiff"] == 0
    smooth = trunnion.simulate("spherical_pendulum", method="rk8", until=5.0, outputs="ball.q[1]")
    assert smooth.stats.counters["stiff"] <= 0.5 * smooth.stats.steps
    assert not any("stiff" in n for n in smooth.notes)
