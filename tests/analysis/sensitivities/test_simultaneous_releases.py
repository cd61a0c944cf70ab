"""Derivatives across the instant at which several pairs at rest are released together."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion
from tests.analysis.sensitivities.test_derivatives_along_runs import ACROSS, off
from trunnion.scene import scene_from_dict
from trunnion.scene.data_classes.scene import Scene

STATIC = 1.5


def train(rng: np.random.Generator, shafts: int) -> tuple[Scene, np.ndarray, np.ndarray, float, float]:
    """Geared shafts that seals hold while a torque grows.

    Returns the scene, ratios, friction torques, N m, inertia seen by the first shaft, kg m², and the torque's slope, N m/s.
    """
    radii, torques, inertias = rng.integers(15, 51, shafts) * 2e-3, rng.uniform(0.02, 0.3, shafts), rng.uniform(5e-4, 5e-3, shafts)
    places = np.concatenate([[0.0], np.cumsum(radii[:-1] + radii[1:])])
    slope = float(rng.uniform(1.0, 3.0) * STATIC * torques @ (radii[0] / radii))
    scene = scene_from_dict({
        "schema": 1, "name": "train", "gravity": [0, 0, 0],
        "bodies": {f"b{i}": {"mass": 1.0, "inertia": [inertias[i]] * 3, "position": [places[i], 0, 0]} for i in range(shafts)},
        "joints": {
            f"r{i}": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": f"b{i}", "at": [places[i], 0, 0],
                      "friction": {"torque": torques[i], "mu": 1.0, "mu_static": STATIC},
                      **({"effort": {"ramp": {"start": 0.0, "end": slope, "duration": 1.0}}} if i == 0 else {})}
            for i in range(shafts)
        } | {
            f"g{i}": {"type": "gear", "axis": "z", "inboard": f"b{i}", "outboard": f"b{i + 1}", "radii": [radii[i], radii[i + 1]]}
            for i in range(shafts - 1)
        },
    })  # fmt: skip
    ratios = radii[0] / radii
    return scene, ratios, torques, float(inertias @ ratios**2), slope


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(6))
def test_a_train_of_shafts_that_let_go_together_has_the_derivative_of_its_closed_form(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shafts = int(rng.integers(2, 5))
    scene, ratios, torques, inertia, slope = train(rng, shafts)
    names = [f"joints.r{i}.friction.torque" for i in range(shafts)]
    found = trunnion.sensitivity(scene, names, ["r0.qd[1]"], 1.0, 0.1)
    slip, sliding = STATIC * ratios @ torques / slope, ratios @ torques
    expected = -((1.0 - slip) * ratios + (slope * slip - sliding) * STATIC * ratios / slope) / inertia
    assert found.derivatives[-1, 0] == pytest.approx(expected, rel=1e-6)
    assert found.events[0].shift == pytest.approx(STATIC * ratios / slope, rel=1e-6)
    assert not found.notes


def loop(seed: int) -> Scene:
    """A slider-crank that friction in its three pins and its guide holds until a torque grows too large."""
    rng = np.random.default_rng(seed)
    a = rng.uniform(0.08, 0.12)
    b, angle = a * rng.uniform(2.0, 3.0), rng.uniform(0.6, 1.2)
    pin = np.array([a * np.cos(angle), a * np.sin(angle), 0.0])
    end = np.array([pin[0] + np.sqrt(b**2 - pin[1] ** 2), 0.0, 0.0])

    def friction(**sizes: float) -> dict[str, float]:
        mu = float(rng.uniform(0.1, 0.3))
        return {"mu": mu, "mu_static": mu * float(rng.uniform(1.2, 1.6)), **sizes}

    pins = {"radius": 0.01, "half_length": 0.02}
    return scene_from_dict({
        "schema": 1, "name": "loop", "gravity": [0, 0, 0],
        "bodies": {
            "crank": {"mass": 1.0, "inertia": [2e-3] * 3, "position": list(pin / 2)},
            "rod": {"mass": 0.5, "inertia": [1e-3] * 3, "position": list((pin + end) / 2)},
            "slider": {"mass": 0.8, "inertia": [1e-3] * 3, "position": list(end)},
        },
        "joints": {
            "main": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "crank", "at": [0, 0, 0],
                     "friction": friction(**pins), "effort": {"ramp": {"start": 0.0, "end": 1.0, "duration": 1.0}}},
            "crankpin": {"type": "revolute", "axis": "z", "inboard": "crank", "outboard": "rod", "at": list(pin),
                         "friction": friction(**pins)},
            "gudgeon": {"type": "revolute", "axis": "z", "inboard": "rod", "outboard": "slider", "at": list(end),
                        "friction": friction(**pins)},
            "guide": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "slider", "at": list(end),
                      "friction": friction(half_width=0.02, half_height=0.02, half_length=0.05)},
        },
        "forces": {"load": {"type": "force", "on": "slider", "force": [0.0, -5.0, 0.0]}},
    })  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_loop_whose_pairs_let_go_together_has_the_derivative_of_differences(seed: int) -> None:
    names = ["joints.main.friction.mu_static", "joints.guide.friction.mu", "joints.crankpin.friction.radius", "bodies.rod.mass"]
    assert off(loop(seed), names, ["main.qd[1]", "guide.q[1]"], 0.4) < ACROSS
