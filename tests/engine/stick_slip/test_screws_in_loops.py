"""Screws in loops. Several threads on one spindle slip at one instant. A crank jams where a force on the nut cannot drive the
screw."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.reference.scenes.random_device_scenes import crossed_dict
from trunnion import scene_from_dict, simulate
from trunnion.simulation.results.result import Result


def two_nuts(seed: int) -> dict[str, Any]:
    """A spindle under a growing torque, with two nuts on guides. Weight and preloads load the bearing, the guides and the
    threads."""
    rng = np.random.default_rng([11, seed])
    disc = {"mass": 1.2, "inertia": [3e-4, 3e-4, 5e-4], "position": [0, 0, 0], "center": [1e-3, -2e-4, 0]}
    bodies: dict[str, Any] = {"spindle": disc}
    bearing = {"mu": rng.uniform(0.2, 0.4), "radius": 0.01, "half_length": 0.015, "thrust_radius": 0.012}
    push = {"ramp": {"start": 0.0, "end": float(rng.choice([-4.0, 4.0])), "duration": 1.0}}
    joints: dict[str, Any] = {"turn": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "spindle",
                                       "friction": bearing, "effort": push}}  # fmt: skip
    for i in range(2):
        at, m = [0.0, 0.0, 0.05 * i], float(rng.uniform(0.5, 4))
        bodies[f"nut{i}"] = {"mass": m, "inertia": [5e-4 * m] * 3, "position": at}
        guide = {"mu": rng.uniform(0.1, 0.25), "half_width": 0.02, "half_height": 0.02, "half_length": rng.uniform(0.06, 0.15)}
        joints[f"rail{i}"] = {"type": "prismatic", "axis": "z", "inboard": "ground", "outboard": f"nut{i}", "at": at,
                              "friction": guide}  # fmt: skip
        thread = {"mu": rng.uniform(0.16, 0.25), "radius": rng.uniform(0.007, 0.012), "flank_angle": rng.uniform(0, 0.5),
                  "preload": rng.uniform(5, 40)}  # fmt: skip
        joints[f"thread{i}"] = {"type": "screw", "axis": "z", "inboard": "spindle", "outboard": f"nut{i}", "at": at,
                                "pitch": rng.uniform(0.004, 0.008), "friction": thread}  # fmt: skip
    return {"schema": 1, "gravity": [0, 0, -9.81], "bodies": bodies, "joints": joints, "simulation": {"until": 0.4, "every": 0.4}}


def release(r: Result) -> float:
    """The instant at which the spindle first slips."""
    return next(e.time for e in r.events if e.kind == "slip" and e.joint == "turn")


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.slow
def test_a_spindle_with_two_nuts_lets_go_at_one_instant_whatever_the_settings(seed: int) -> None:
    scene = scene_from_dict(two_nuts(seed))
    runs = [simulate(scene, method=m, rtol=rtol) for m, rtol in (("auto", 1e-6), ("rk5", 1e-6), ("auto", 1e-9))]
    times = [release(r) for r in runs]
    assert times == pytest.approx([times[0]] * len(times), abs=1e-9)
    # One freedom moves all pairs. The freedom starts to move, with zero acceleration, where the sliding friction of all pairs
    # balances the torque.
    after = simulate(scene, until=times[0] + 1e-5, every=times[0] + 1e-5, rtol=1e-9, outputs=["turn.qdd[1]"])
    # the limit is small relative to the acceleration by the torque without friction
    assert abs(after["turn.qdd[1]"][-1]) < 1e-3 * 4.0 * times[0] / 5e-4


def crank_and_screw(seed: int, back: float) -> dict[str, Any]:
    """A flywheel turns a crank, whose rod moves a nut. The thread of the nut turns a spindle on a thrust bearing. The spindle
    drives the nut towards the end of its stroke. back: ratio of two arms, the friction arm of the thrust face and the arm at which
    a force on the nut drives the spindle. With back > 1, the nut cannot drive the spindle."""
    rng = np.random.default_rng([12, seed])
    crank, rod, angle = 0.05, float(rng.uniform(0.15, 0.25)), float(rng.uniform(0.5, 0.9))
    r, mu, flank = float(rng.uniform(0.006, 0.01)), float(rng.uniform(0.05, 0.15)), float(rng.uniform(0, 0.4))
    pitch = float(rng.uniform(0.02, 0.03))
    arm = r * math.tan(math.atan(pitch / (2 * math.pi * r)) - math.atan(mu / math.cos(flank)))
    pin = np.array([crank * math.cos(angle), crank * math.sin(angle)])
    nut = [float(pin[0] + math.sqrt(rod**2 - pin[1] ** 2)), 0.0, 0.0]
    middle, lean = [float((pin[0] + nut[0]) / 2), float(pin[1] / 2), 0.0], math.atan2(-pin[1], nut[0] - pin[0])
    bodies = {
        "crank": {"mass": 1, "inertia": [0.01] * 3, "position": [0, 0, 0]},
        "rod": {"mass": 0.1, "inertia": [1e-4] * 3, "position": middle, "orientation": {"axis": "z", "angle": lean}},
        "nut": {"mass": 0.3, "inertia": [1e-4] * 3, "position": nut},
        "spindle": {"mass": 1, "inertia": [1e-4] * 3, "position": nut},
    }  # fmt: skip
    # The bearing is thin, so that lateral loads on it have little effect.
    bearing = {"mu": 0.2, "radius": 1e-5, "half_length": 0.05, "thrust_radius": back * arm / 0.2}
    places = (("turn", "revolute", "ground", "crank", [0, 0, 0], "z"), ("a", "revolute", "crank", "rod", [*pin.tolist(), 0], "z"),
              ("b", "revolute", "rod", "nut", nut, "z"), ("guide", "prismatic", "ground", "nut", nut, "x"),
              ("spin", "revolute", "ground", "spindle", nut, "x"), ("thread", "screw", "spindle", "nut", nut, "x"))  # fmt: skip
    joints: dict[str, Any] = {n: {"type": k, "inboard": i, "outboard": o, "at": at, "axis": x} for n, k, i, o, at, x in places}
    joints["turn"]["start"] = {"qd": -5.0}
    joints["spin"]["friction"] = bearing
    joints["thread"] |= {"pitch": pitch, "friction": {"mu": mu, "radius": r, "flank_angle": flank}}
    return {"schema": 1, "gravity": [0, 0, 0], "bodies": bodies, "joints": joints, "simulation": {"until": 0.3, "every": 0.01}}


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("back", [0.8, 1.25])
def test_a_crank_jams_at_its_dead_centre_exactly_where_the_screw_cannot_be_driven_back(seed: int, back: float) -> None:
    r = simulate(scene_from_dict(crank_and_screw(seed, back)))
    assert r.outcome.name == ("done" if back < 1 else "jammed")
    if back > 1:  # the spindle comes to rest at the end of the stroke, within less than one more row
        rates = r["guide.qd[1]"]
        assert abs(rates[-1]) < 1.1 * abs(rates[-1] - rates[-2])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [71, 66, 69])
@pytest.mark.slow
def test_a_lever_jams_where_its_screw_cannot_be_driven_back_and_continues_after_the_impact(seed: int) -> None:
    """Where the nut reverses, the lever's rate prescribes the spindle's acceleration. A force on the nut drives the spindle by the
    thread, but brakes the spindle more by the thrust bearing. The spindle's own torque acts against this acceleration. In this
    state, no modes obey the laws."""
    data = crossed_dict("screw_levers", seed)
    r = simulate(scene_from_dict(data), outputs=["turn.*"])
    thread, bearing = data["joints"]["thread"], data["joints"]["turn"]["friction"]
    rub = thread["friction"]
    lead = math.atan(thread["pitch"] / (2 * math.pi * rub["radius"])) - math.atan(rub["mu"] / math.cos(rub["flank_angle"]))
    assert rub["radius"] * math.tan(lead) < bearing["mu"] * bearing["thrust_radius"]
    assert r["turn.effort[1]"][-1] * r["turn.qdd[1]"][-1] < 0.0
    # the spindle comes to rest within one row
    assert abs(r["turn.qd[1]"][-1]) < 1.1 * abs(r["turn.qdd[1]"][-1]) * (r.time[-1] - r.time[-2])
    assert (r.outcome.name, r.outcome.joint) in {("jammed", "n"), ("jammed", "p")}
    data["simulation"]["jams"] = "impact"
    ends = [simulate(scene_from_dict(data), method=m, outputs=["turn.q[1]"]) for m in ("rk5", "rosenbrock")]
    assert all(e.outcome.ok and "impact" in [x.kind for x in e.events] for e in ends)
    assert ends[0]["turn.q[1]"][-1] == pytest.approx(ends[1]["turn.q[1]"][-1], rel=1e-4)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("method", ["rosenbrock", "rk5", "auto"])
def test_a_screw_that_loses_its_root_jams_by_every_method(method: str) -> None:
    """At 0.770411 s, the root of friction merges with an unstable root, and no later motion is determined. With contacts of four
    stiffnesses, each four times the previous stiffness, the screw stops later. Its stops approach this time: after 0.85, at 0.83,
    0.81 and 0.785 s. A stiff step over this time has no solution in its middle."""
    r = simulate(scene_from_dict(crossed_dict("screw_levers", 20)), method=method, rtol=1e-8, kernel="parts")
    assert (r.outcome.name, r.outcome.joint) == ("jammed", "turn")
    assert r.outcome.time == pytest.approx(0.770411, abs=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_spindle_whose_torque_reverses_while_it_rests_slips_at_the_torque_of_its_new_direction(side: float) -> None:
    """A torque first presses the load of a nut down, then reverses and raises the load. The thread's normal force depends on the
    direction of friction, so the thread must take its new direction before it slips."""
    r, pitch, mu, beta, load, rest, collar = 0.0075, 0.006, 0.11, 0.1, 12.0, 0.4, 0.01
    lead, rub = math.atan(pitch / (2 * math.pi * r)), mu / math.cos(beta)
    raising = load * (r * (math.tan(lead) + rub) / (1 - rub * math.tan(lead)) + rest * collar)
    lowering = load * (r * (rub - math.tan(lead)) / (1 + rub * math.tan(lead)) + rest * collar)
    torque = {"ramp": {"start": -0.9 * lowering * side, "end": 1.1 * raising * side, "duration": 1.0}}
    bearing = {"mu": 0.3, "mu_static": rest, "radius": 1e-9, "half_length": 0.05, "thrust_radius": collar}
    bodies = {n: {"mass": 1.0, "inertia": [1e-3] * 3} for n in ("spindle", "nut")}
    joints: dict[str, Any] = {
        "turn": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "spindle", "friction": bearing,
                 "effort": torque},
        "guide": {"type": "prismatic", "axis": "z", "inboard": "ground", "outboard": "nut", "effort": -load},
        "thread": {"type": "screw", "axis": "z", "inboard": "spindle", "outboard": "nut", "pitch": -pitch * side,
                   "friction": {"mu": mu, "radius": r, "flank_angle": beta}},
    }  # fmt: skip
    scene = {"schema": 1, "gravity": [0, 0, 0], "bodies": bodies, "joints": joints, "simulation": {"until": 1.0, "every": 1.0}}
    run = simulate(scene_from_dict(scene), kernel="parts")
    assert release(run) == pytest.approx((raising + 0.9 * lowering) / (1.1 * raising + 0.9 * lowering), rel=1e-7)
