"""While nothing moves and no load changes, the number of steps does not grow with time, and the run misses no later event."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.reference.scenes.random_streams import stream
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.data_classes.loads import Force
from trunnion.simulation.run import simulate

METHODS = ("rk5", "rk8", "rosenbrock", "auto")
STEPS = 60
"""Largest number of steps of a run with one slip, for any duration. A step is at most six times as long as the last one, so the
step grows from 1e-6 s to 1e5 s in fourteen steps. The slip takes as many steps."""


def pile(seed: int, late: float, size: float = 1.0) -> tuple[sm.Scene, float]:
    """Up to three blocks rest on top of each other on an inclined table, in units of ``size``, m. A force that begins to grow at
    ``late``, s, pushes the top block. Also returns the hand-calculated time of the first slip, s."""
    rng = stream("pile", seed)
    gravity, lean = 9.81 * size, float(rng.uniform(0.02, 0.1))
    masses = [float(x) for x in rng.uniform(0.5, 5.0, int(rng.integers(1, 4)))]
    rough = [float(x) for x in rng.uniform(0.2, 0.8, len(masses))]
    above = np.cumsum(masses[::-1])[::-1]
    spare = [(mu * math.cos(lean) - math.sin(lean)) * m * gravity for mu, m in zip(rough, above, strict=True)]
    push = sm.Signal(ramp=sm.Ramp(0.0, 2.0 * min(spare), 1.0, late))
    bodies, joints = {}, {}
    for k, (m, mu) in enumerate(zip(masses, rough, strict=True)):
        bodies[f"b{k}"] = sm.Body(mass=m, inertia=(0.1 * size**2,) * 3)
        rub = sm.Friction(mu=mu, half_width=0.01 * size, half_height=0.01 * size, half_length=0.5 * size)
        joints[f"j{k}"] = sm.Joint("prismatic", f"b{k - 1}" if k else "ground", f"b{k}", axis="x", pin="outboard", friction=rub)
    load = Force(on=f"b{len(masses) - 1}", type="force", force=(push, 0.0, 0.0))
    gravity_vector = (gravity * math.sin(lean), 0.0, -gravity * math.cos(lean))
    scene = sm.Scene(bodies, joints, gravity=gravity_vector, forces={"push": load})
    return scene, late + 0.5


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("size", [1.0, 100.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_pile_of_blocks_waits_for_its_load_in_no_more_steps_however_late_it_comes(seed: int, size: float) -> None:
    for method in METHODS:
        for rtol in (1e-4, 1e-8):
            for late in (1.0, 1e3, 1e5):
                scene, slips = pile(seed, late, size)
                r = simulate(scene, until=late + 0.6, every=late + 0.6, method=method, rtol=rtol)
                assert r.outcome.ok
                assert [e.time for e in r.events if e.kind == "slip"] == pytest.approx([slips], rel=1e-12, abs=1e-9)
                assert r.stats.steps <= STEPS, (method, rtol, late)
