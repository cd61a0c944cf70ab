"""A rocker without mass stops while its rod touches the friction circle of its pin. Drag is the load of the rod. This load responds
in a part of the time that remains until the stop, so steps of every method shrink towards the stop."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.loops.test_convergence_to_zero_mass import heavy_parts
from tests.reference.scenes.random_device_scenes import crossed_dict
from trunnion import Scene, scene_from_dict, simulate

SETTINGS = (("auto", 1e-6), ("auto", 1e-8), ("auto", 1e-10), ("rk5", 1e-8), ("rosenbrock", 1e-8))
LOOSEST, TIGHTEST = SETTINGS[0], SETTINGS[2]
TIME = 30.0
"""Allowed difference of two stops, relative to the looser tolerance times the duration of 0.2 s. A run's error is up to ten
times its tolerance (RUN_ERROR), and steps before the stop add as much."""
STEPS = 6
"""Allowed ratio of the steps at the tightest and the loosest tolerance. Steps of order 8 get shorter by the eighth root of 1e4,
which is 3.2; and towards the stop, steps cover two more decades of time."""


def braked_rocker(seed: int) -> Scene:
    """A driven crank, and a rocker without mass in air. Friction, drag, torque and speed are random."""
    rng, scene = np.random.default_rng([7, seed]), crossed_dict("rod_loops", 3)
    crank, rocker = scene["joints"]["j0"], scene["joints"]["j1"]
    del rocker["friction"]["mu_static"]
    for place, key in ((rocker["friction"], "mu"), (rocker["friction"], "radius"), (scene["forces"]["air1"], "area"),
                       (crank["effort"]["trapezoid"], "peak"), (crank["start"], "qd")):  # fmt: skip
        place[key] *= float(rng.uniform(0.75, 1.3))
    return heavy_parts(scene_from_dict(scene), "rocker", 0.0)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(40))
def test_a_rocker_without_mass_stops_at_its_friction_circle_at_one_time_and_in_few_steps(seed: int) -> None:
    stops, steps = {}, {}
    for method, rtol in SETTINGS:
        r = simulate(braked_rocker(seed), until=0.2, every=0.2, method=method, rtol=rtol, kernel="parts", outputs="*.q*")
        assert (r.outcome.name, r.audit.verdict) == ("done", "within"), (method, rtol)
        stops[method, rtol] = [e.time for e in r.events if e.kind == "stick"]
        steps[method, rtol] = r.stats.steps
    exact = stops[TIGHTEST]
    for (method, rtol), found in stops.items():
        assert found == pytest.approx(exact, abs=TIME * rtol * 0.2), (method, rtol)
    assert len(exact) == 2
    assert steps[TIGHTEST] <= STEPS * steps[LOOSEST]
