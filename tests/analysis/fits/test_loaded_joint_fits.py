"""Friction of a robot's joint that grows with its load is fitted from the noisy torque of its drive."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from trunnion import MeasuredRun, Scene, fit, scene_from_dict, simulate

TRUTH = {"torque": 4.0, "load_friction": 0.12, "load_friction_backward": 0.2}
PATHS = {f"joints.elbow.friction.{name}": value for name, value in TRUTH.items()}
TORQUE, NOISE, SETS = "elbow.drive.effort[1]", 2.0, 500


@cache
def robot() -> tuple[Scene, MeasuredRun]:
    """A driven elbow, and the exact torque of its drive. The arm's weight alternately assists and opposes the motion."""
    joint = {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": "arm", "friction": TRUTH,
             "drive": {"harmonic": {"amplitude": 1.2, "frequency": 0.53, "offset": 0.3}}}  # fmt: skip
    arm = {"mass": 20, "center": [0.5, 0, 0], "inertia": [1, 1, 1]}
    scene = scene_from_dict({"gravity": [0, 0, -9.81], "bodies": {"arm": arm}, "joints": {"elbow": joint},
                             "simulation": {"until": 4, "every": 0.04}})  # fmt: skip
    r = simulate(scene, rtol=1e-8, outputs=[TORQUE])
    return scene, MeasuredRun(r.time, {TORQUE: r[TORQUE]})


def held(seed: int) -> list[bool]:
    """Whether each 95 % interval of a fit to noisy data contains the true value."""
    scene, exact = robot()
    noise = np.random.default_rng(seed).normal(0.0, NOISE, len(exact.time))
    found = fit(scene, list(PATHS), runs=[MeasuredRun(exact.time, {TORQUE: exact.curves[TORQUE] + noise})])
    assert found.converged
    return [found.intervals[path].low <= value <= found.intervals[path].high for path, value in PATHS.items()]


def test_exact_data_give_the_numbers_of_the_friction() -> None:
    scene, exact = robot()
    start = {path: 1.3 * value for path, value in PATHS.items()}
    found = fit(scene, list(PATHS), runs=[exact], overrides=start, intervals=False)
    assert found.values == pytest.approx(PATHS, rel=1e-6)


@pytest.mark.slow
def test_95_percent_intervals_of_500_fits_hold_the_truth() -> None:
    """Between 92.5 and 97.5 % of the intervals of each number contain the true value."""
    shares = np.mean([held(seed) for seed in range(SETS)], axis=0)
    assert np.all((shares >= 0.925) & (shares <= 0.975)), shares
