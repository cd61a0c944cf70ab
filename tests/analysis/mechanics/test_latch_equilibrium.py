"""A mechanism that rests on the hook of a latch stays on the hook. The hook's spring determines the poses of rest, the oscillations
about these poses, and the ranges that friction adds. The references are closed forms, except for the root of one equation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from trunnion import equilibrium, modes
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_text
from trunnion.simulation.run import simulate

G, HALF, MASS = 9.81, 0.3, 2.0
INERTIA = MASS * ((2 * HALF) ** 2 + 0.05**2) / 12 + MASS * HALF**2
KERNELS = ("parts", "compiled")
CASES = [(seed, kernel) for seed in range(4) for kernel in KERNELS[: 1 + (seed == 0)]]


def raised(seed: int, friction: float = 0.0, **latch: object) -> tuple[float, float, sm.Scene]:
    """An arm that has been lifted past a hook and rests on this hook. Returns the place and stiffness of the hook, and the
    scene."""
    rng = np.random.default_rng(seed)
    at, stiff, above = -rng.uniform(0.2, 1.2), 10 ** rng.uniform(3, 6), rng.uniform(0.05, 0.3)
    own = ", ".join(f"{k}: {v}" for k, v in {"at": at, "keeps": "below", "stiffness": stiff, **latch}.items())
    rubs = f", friction: {{torque: {friction}}}" if friction else ", damping: 0.2"
    return at, stiff, scene_from_text(f"""
schema: 1
gravity: [0, 0, {-G}]
bodies: {{arm: {{box: [{2 * HALF}, 0.05, 0.05], mass: {MASS}, points: {{end: [{-HALF}, 0, 0]}}}}}}
joints:
  hinge: {{type: revolute, axis: y, inboard: ground, outboard: arm.end, start: {{q: {at - above}}}, latch: {{{own}}}{rubs}}}
simulation: {{until: 1 s, every: 10 ms}}
""")


def rests(at: float, stiff: float, torque: float = 0.0) -> float:
    """The angle at which the moments of weight and hook and a torque balance."""
    return brentq(lambda q: MASS * G * HALF * np.cos(q) + stiff * (at - q) + torque, at, at + 0.1, xtol=1e-15)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_an_arm_on_its_hook_rests_and_oscillates_there(seed: int) -> None:
    at, stiff, scene = raised(seed)
    q = rests(at, stiff)
    found = modes(scene)
    assert found.q["hinge"][0] == pytest.approx(q, abs=1e-10)
    assert equilibrium(scene).kind == "stable"
    swing = np.sqrt((stiff + MASS * G * HALF * np.sin(q)) / INERTIA - (0.1 / INERTIA) ** 2) / (2 * np.pi)
    assert [m.frequency for m in found.modes] == pytest.approx([swing], rel=1e-7)


def test_friction_holds_the_block_on_its_hook_in_a_band() -> None:
    at, stiff, scene = raised(0, friction=0.8)
    (band,) = equilibrium(scene).bands
    assert (band.low, band.high) == pytest.approx((rests(at, stiff, -0.8), rests(at, stiff, 0.8)), abs=1e-9)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize(("seed", "kernel"), CASES)
def test_a_hook_that_begins_down_carries_from_the_start_what_presses_it(seed: int, kernel: str) -> None:
    at, stiff, scene = raised(seed, down="true")
    q = rests(at, stiff)
    r = simulate(scene, rtol=1e-10, kernel=kernel, overrides={"joints.hinge.start.q": q})
    assert np.abs(r["hinge.q[1]"] - q).max() < 1e-2 * (q - at)  # explicit steps are near their stability limit at this stiffness
    assert r["hinge.latch.effort[1]"] == pytest.approx(-MASS * G * HALF * np.cos(q), rel=1e-2)
    assert not r.events
    falls = simulate(scene, kernel=kernel, overrides={"joints.hinge.start.q": q, "joints.hinge.latch.holds": 1e-3})
    assert falls["hinge.q[1]"][-1] > q + 0.5  # the hook releases the arm if the load is too large at the start
