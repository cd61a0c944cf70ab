"""The motion of a loop, its events and the work of its friction do not depend on the joint at which the loop is cut."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.sampling import crossed
from trunnion import scene_from_dict, sensitivity, simulate, sweep
from trunnion.simulation.results.result import Result

CUTS = ("main", "crankpin", "gudgeon", "guide")


def slider_crank(rng: np.random.Generator, guide: dict[str, float], pins: bool) -> dict[str, Any]:
    """A slider-crank that a torque drives through its dead centres, with all start values. guide: friction of the guide; pins:
    whether the hinges have friction."""
    short, long = rng.uniform(0.05, 0.2), rng.uniform(0.25, 0.6)
    masses, angle, rate = rng.uniform(0.5, 2.0, 3), rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 3.0)
    lean = -math.asin(short * math.sin(angle) / long)
    tilt = -short * math.cos(angle) * rate / (long * math.cos(lean))  # rate of the rod's angle
    rods = [{"mass": m, "center": [length / 2, 0, 0], "inertia": [m * length**2 / 12] * 3, "points": {"end": [length, 0, 0]}}
            for m, length in zip(masses, (short, long), strict=False)]  # fmt: skip
    torque = rng.uniform(0.3, 1.5)
    starts = {
        "main": (angle, rate), "crankpin": (lean - angle, tilt - rate), "gudgeon": (-lean, -tilt),
        "guide": (short * math.cos(angle) + long * math.cos(lean), -short * math.sin(angle) * rate - long * math.sin(lean) * tilt),
    }  # fmt: skip
    sides = (("ground", "crank"), ("crank.end", "rod"), ("rod.end", "piston"), ("ground", "piston"))
    joints: dict[str, dict[str, Any]] = {
        n: {"type": "prismatic" if n == "guide" else "revolute", "axis": "x" if n == "guide" else "z", "inboard": a, "outboard": b,
            "start": {"q": starts[n][0], "qd": starts[n][1]}}
        for n, (a, b) in zip(CUTS, sides, strict=True)
    }  # fmt: skip
    joints["main"]["effort"] = {"ramp": {"start": torque, "end": torque * rng.uniform(-2.0, 3.0), "duration": 1}}
    joints["guide"]["friction"] = guide
    for n in ("main", "crankpin", "gudgeon"):
        if pins:
            joints[n]["friction"] = {"mu": rng.uniform(0.05, 0.3), "radius": rng.uniform(0.004, 0.01), "half_length": 0.01}
    bodies = {"crank": rods[0], "rod": rods[1], "piston": {"mass": masses[2], "inertia": [1e-3] * 3}}
    return {"schema": 1, "gravity": [0, -9.81, 0], "bodies": bodies, "joints": joints, "simulation": {"until": 1.0}}


def runs(scene: dict[str, Any], **how: Any) -> dict[str, Result]:
    """The run of a slider-crank for each cut."""
    found = {}
    for cut in CUTS:
        joints = {n: j | {"cut": True} if n == cut else j for n, j in scene["joints"].items()}
        found[cut] = simulate(scene_from_dict(scene | {"joints": joints}), outputs=["main.q*", "energy.dissipated"], **how)
    return found


def assert_alike(found: dict[str, Result], close: float) -> None:
    """Angle and work at the end agree, relative to their size. Starts and ends of sliding agree, too."""
    assert {r.outcome.name for r in found.values()} == {"done"}
    for column in ("main.q[1]", "energy.dissipated"):
        last = [r[column][-1] for r in found.values()]
        assert np.ptp(last) <= close * max(1.0, max(map(abs, last))), column
    events = [sorted((e.kind, e.joint) for e in r.events if e.kind in ("reversal", "stick", "slip")) for r in found.values()]
    assert all(e == events[0] for e in events)


GUIDES = [{"force": 2.0}, {"mu": 0.2, "half_length": 0.05, "half_width": 0.02, "half_height": 0.02}]


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("seed", "guide", "pins"), crossed(range(6), GUIDES, [False, True]))
def test_a_crank_that_passes_its_dead_centres_moves_alike_wherever_its_loop_is_cut(
    seed: int, guide: dict[str, float], pins: bool
) -> None:
    """Earlier, stopping the guide at its reversal took the crank's speed. An error of 1e-8 in a step grows tenfold with the crank's
    turns."""
    assert_alike(runs(slider_crank(np.random.default_rng(seed), guide, pins), rtol=1e-9), 1e-6)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(4))
def test_springs_and_stops_act_beyond_half_a_turn_wherever_the_loop_is_cut(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    scene = slider_crank(rng, {"force": 0.1}, False)
    way = math.copysign(1.0, scene["joints"]["main"]["start"]["qd"])
    stops = {"stiffness": 500.0, "upper" if way > 0 else "lower": way * 6.0}
    device = {"spring": {"stiffness": 0.05}} if seed % 2 else {"end_stops": stops}
    scene["joints"]["main"] |= {"effort": way * 2.0, **device}
    found = runs(scene, rtol=1e-9)
    assert max(np.abs(r["main.q[1]"]).max() for r in found.values()) > 5.0
    assert_alike(found, 1e-6)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("given", CUTS)
@pytest.mark.parametrize("seed", range(3))
def test_start_values_act_wherever_the_loop_is_cut(seed: int, given: str) -> None:
    """One joint has a start rate. The other joints have only start positions, which leave no choice between two poses."""
    scene = slider_crank(np.random.default_rng(200 + seed), {"force": 0.5}, False)
    rate = scene["joints"][given]["start"]["qd"]
    for n in set(CUTS) - {given}:
        del scene["joints"][n]["start"]["qd"]
    found = runs(scene, rtol=1e-9)
    assert_alike(found, 1e-6)
    for cut in CUTS:
        joints = {n: j | {"cut": True} if n == cut else j for n, j in scene["joints"].items()}
        started = simulate(scene_from_dict(scene | {"joints": joints}), outputs=[f"{given}.qd*"], until=0.01)
        assert started[f"{given}.qd[1]"][0] == pytest.approx(rate, rel=1e-9)


def test_a_start_value_at_a_cut_is_swept_and_differentiated() -> None:
    """A jack whose guide has a start rate: the spindle turns with 2π/pitch of this rate."""
    pitch = 0.01
    scene = scene_from_dict({
        "schema": 1, "gravity": [0, 0, 0],
        "bodies": {"spindle": {"mass": 1.0, "inertia": [1e-3] * 3}, "nut": {"mass": 5.0, "inertia": [1e-2] * 3}},
        "joints": {
            "bearing": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "spindle", "spring": {"stiffness": 1e-9}},
            "guide": {"type": "prismatic", "axis": "z", "inboard": "ground", "outboard": "nut", "start": {"qd": -0.01},
                      "cut": True},
            "thread": {"type": "screw", "axis": "z", "inboard": "spindle", "outboard": "nut", "pitch": pitch},
        },
        "simulation": {"until": 1.0},
    })  # fmt: skip
    slope = -2.0 * math.pi / pitch
    table = sweep(scene, {"joints.guide.start.qd": [-0.02, -0.01, 0.03]}, reductions="final:bearing.q[*]").to_arrow().to_pydict()
    assert table["final:bearing.q[1]"] == pytest.approx([slope * v for v in (-0.02, -0.01, 0.03)], rel=1e-6)
    found = sensitivity(scene, ["joints.guide.start.qd"], ["bearing.q[1]"], 1.0, 0.5)
    assert found.derivatives[-1, 0, 0] == pytest.approx(slope, rel=1e-6)
