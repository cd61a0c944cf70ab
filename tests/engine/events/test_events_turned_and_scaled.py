"""Events, work and verdicts of a run stay the same in a turned world and in other units, where zeros become round-off."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.engine.checks.turned_mirrored_scaled_scenes import factor, image, scaled
from tests.engine.loops.test_cut_choice import CUTS, slider_crank
from tests.reference.mechanics.rotation import random_rotation
from trunnion import scene_from_dict, simulate
from trunnion.simulation.results.result import Result

UNITS = ((1e-3, 1.0, 1.0), (1e3, 1.0, 1e3**0.5), (1e4, 1e-3, 10.0))
"""Factors on lengths, masses and times."""


def changes(r: Result, time: float = 1.0) -> list[tuple[str, str, float]]:
    """Kind, joint and time of each event, in order."""
    return sorted((e.kind, e.joint, round(e.time / time, 3)) for e in r.events)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("method", ["rk5", "rk8", "rosenbrock"])
@pytest.mark.parametrize("seed", range(3))
def test_a_crank_passes_its_dead_centres_in_all_units(seed: int, method: str) -> None:
    """The guide, where the loop is cut, reverses at each dead centre and takes no energy from the crank. This must not depend on
    the unit of length."""
    told = slider_crank(np.random.default_rng(seed), {"force": 1.0}, pins=False)
    joints = {n: told["joints"][n] | {"cut": n == "guide"} for n in CUTS}
    scene = scene_from_dict(told | {"joints": joints})
    exact = simulate(scene, rtol=1e-9, outputs=["energy.dissipated"])
    for length, mass, time in UNITS:
        for rtol in (1e-4, 2e-5, 1e-6):
            r = simulate(scaled(scene, length, mass, time), rtol=rtol, method=method, outputs=["energy.dissipated"])
            work = r["energy.dissipated"][-1] / factor("J", length, mass, time)
            assert work == pytest.approx(exact["energy.dissipated"][-1], rel=200 * rtol), (length, rtol)
            assert len(r.events) == len(exact.events)


def geared_shafts(seed: int) -> dict[str, Any]:
    """Two geared shafts coast to rest. A seal holds one shaft and the other shaft is free, so that their teeth carry no load."""
    rng = np.random.default_rng(seed)
    teeth, module = [int(x) for x in rng.integers(15, 40, 2)], 4e-3
    apart = sum(teeth) * module / 2
    holds = float(rng.uniform(0.05, 0.2))
    rubs = {"friction": {"torque": holds}, "effort": float(rng.uniform(-0.8, 0.8)) * holds}
    mesh = {"type": "gear", "inboard": "a", "outboard": "b", "teeth": teeth, "module": module,
            "friction": {"mu": float(rng.uniform(0.05, 0.2)), "pressure_angle": 0.35}}  # fmt: skip
    shafts = {n: {"mass": float(m), "inertia": [2e-3, 2e-3, 1e-3]} for n, m in zip("ab", rng.uniform(1.0, 2.0, 2), strict=True)}
    return {
        "schema": 1, "gravity": [0, -9.81, 0], "simulation": {"until": 2.0, "rtol": 1e-5},
        "bodies": {"a": shafts["a"] | {"position": [0, 0, 0]}, "b": shafts["b"] | {"position": [apart, 0, 0]}},
        "joints": {
            "pa": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "a", "at": [0, 0, 0], "start": {"qd": 3.0}},
            "pb": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "b", "at": [apart, 0, 0], **rubs},
            "mesh": {"axis": "z"} | mesh,
        },
    }  # fmt: skip


def planar_crank(seed: int) -> dict[str, Any]:
    """A driven slider-crank. Its guide could carry loads across the plane of motion, but no loads act across this plane."""
    sleeve = {"mu": 0.2, "half_width": 0.02, "half_height": 0.02, "half_length": 0.05}
    told = slider_crank(np.random.default_rng(seed), sleeve, pins=True)
    main = {k: v for k, v in told["joints"]["main"].items() if k not in ("effort", "start")}
    joints = {n: {k: v for k, v in j.items() if k != "start" or n != "guide"} for n, j in told["joints"].items()}
    q = told["joints"]["main"]["start"]["q"]
    joints["main"] = main | {"drive": {"constant": {"rate": 6.0, "start": q}}}
    return told | {"joints": joints}


def hanging(seed: int) -> dict[str, Any]:
    """A pendulum at rest in its equilibrium position."""
    length = float(np.random.default_rng(seed).uniform(0.05, 0.5))
    pin = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "a", "friction": {"torque": 0.9}}
    body = {"mass": 1.0, "inertia": [0.01, 0.01, 0.01], "center": [0, -length, 0]}
    return {"schema": 1, "gravity": [0, -9.81, 0], "bodies": {"a": body}, "joints": {"r": pin}, "simulation": {"until": 0.5}}


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("make", [geared_shafts, planar_crank, hanging])
@pytest.mark.parametrize("seed", range(4))
def test_forces_that_are_round_off_make_no_events_and_no_notes(seed: int, make: Any) -> None:
    """In a plane of the axes, forces across the plane are exactly zero. In a turned world, they are round-off in random
    directions."""
    scene = scene_from_dict(make(seed))
    own = simulate(scene)
    assert own.audit.verdict == "within"
    Q = random_rotation(np.random.default_rng(seed))
    for turn in (Q, Q @ np.diag([-1.0, 1.0, 1.0])):
        r = simulate(image(scene, turn))
        assert changes(r) == changes(own)
        assert r.audit.verdict == "within", r.audit.notes
