"""Moreau's time stepping is of first order with fixed steps. Under error control its error follows the tolerance. The method finds
the same states of rest and solves the same loops as the other methods. It refuses laws that are stiff near rest."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.benchmarks.numerical_error.pendulum_error import alpha
from tests.default_case_selection import sampled
from tests.engine.stick_slip.test_hard_scenes_all_settings import CASES, worlds
from tests.engine.stick_slip.test_slip_detection_and_energy import ratchet
from tests.reference.scenes.random_device_scenes import crossed
from tests.reference.scenes.random_friction_scenes import rubbing
from tests.reference.scenes.random_streams import stream
from trunnion.basics.errors import SceneError
from trunnion.runtime.integrators import MOREAU
from trunnion.scene import load_scene, scene_from_dict
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import apply
from trunnion.simulation.run import simulate

COULOMB = {"friction.law": "coulomb"}


def swing(step: float) -> float:
    """Angle of example 8.1 at 2 s for a step in s, degrees from the downward vertical."""
    r = simulate("spherical_pendulum", until=2.0, every=1.0, method="moreau", step=step, overrides=COULOMB)
    return float(np.degrees(np.arctan2(r["pendulum.position[1]"][-1], -r["pendulum.position[3]"][-1])))


def test_the_error_of_fixed_steps_is_first_order_in_the_step() -> None:
    """The angle at 2 s is 57.500835748° (F1). Steps of a tenth of the length make errors of about a tenth."""
    coarse, fine = (abs(swing(h) - 57.500835748) for h in (1e-2, 1e-3))
    assert fine < 0.01
    assert 5.0 < coarse / fine < 20.0


def test_the_pendulum_comes_to_rest_and_stays() -> None:
    r = simulate("spherical_pendulum", until=12.0, every=0.5, method="moreau", step=1e-3, overrides=COULOMB)
    late = r.time > 9.6
    assert np.all(r["ball.qd[2]"][late] == 0.0)
    assert [e.kind for e in r.events].count("stick") >= 1
    assert np.degrees(np.ptp(r["pendulum.position[1]"][late])) == 0.0


def test_loops_stay_closed() -> None:
    r = simulate("crank_slider", until=1.0, every=0.01, method="moreau", step=1e-3, overrides=COULOMB)
    assert r.outcome.ok
    assert r["audit.constraint"].max() <= 1e-13  # lengths of about 1 m have this round-off


def test_two_component_sliding_follows_the_located_run() -> None:
    """Example 8.3 travels as far as in a run with event location, up to an error of the order of the step."""
    r = simulate("double_pendulum", until=1.0, every=0.25, method="moreau", step=1e-4, overrides=COULOMB)
    assert r["guide.q[1]"][[1, 2, 4]] == pytest.approx([2.45822543, 4.71556233, 8.32814713], abs=1e-4)


@pytest.mark.parametrize("law", ["regularized"])
def test_a_law_that_is_stiff_near_rest_is_refused(law: str) -> None:
    with pytest.raises(SceneError, match="moreau"):
        simulate("spherical_pendulum", until=0.1, method="moreau", step=1e-3, overrides={"friction.law": law})


# -- under error control ----------------------------------------------------------------------------------------------------------

TOLERANCES = 10.0 ** -np.arange(3, 9)
C = 25.0
"""Factor C: errors in m and rad, m/s and rad/s stay below C rtol. The steps and up to fourteen events accumulate errors of 12.3
rtol."""
Way = Callable[[np.ndarray], np.ndarray]
"""Position and rate (2×n) at n times, computed without the engine."""


def swinging() -> tuple[sm.Scene, str, float, Way]:
    """Example 8.1 before its first reversal, from the acceleration in closed form."""
    exactly = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "dense_output": True}
    s = solve_ivp(lambda t, y: [y[1], alpha(y[0], y[1], -1)], (0, 0.9), [math.pi / 2, 0.0], **exactly)
    return apply(load_scene("spherical_pendulum"), COULOMB), "ball", 0.9, lambda t: s.sol(t)


def belt(seed: int) -> tuple[sm.Scene, str, float, Way]:
    """A block on a belt, held by a spring, with static friction above sliding friction. Its stick-slip motion has a closed form."""
    rng = stream("moreau belt", seed)
    mass, stiffness, mu, more = (float(rng.uniform(*r)) for r in ((0.5, 2.0), (1.0, 5.0), (0.1, 0.3), (0.2, 0.8)))
    speed, weight = float(rng.uniform(0.1, 0.3)), 10.0 * mass
    rub = sm.Friction(mu=mu, mu_static=mu * (1 + more), half_length=0.5, half_width=0.05, half_height=0.05)
    joints = {
        "drive": sm.Joint("prismatic", "ground", "belt", axis="x", drive=sm.Drive(constant=sm.Constant(speed))),
        "rub": sm.Joint("prismatic", "belt", "block", axis="x", pin="outboard", friction=rub),
    }
    lump = sm.Body(mass=mass, inertia=(1.0, 1.0, 1.0))
    spring = sm.SpringDamper("spring_damper", ("ground.wall", "block"), stiffness=stiffness, length=1.0)
    ground = sm.Ground(points={"wall": (-1.0, 0.0, 0.0)})
    scene = sm.Scene({"belt": lump, "block": lump}, joints, "belt", gravity=(0, 0, -10.0), ground=ground, forces={"spring": spring})
    middle, omega = mu * weight / stiffness, math.sqrt(stiffness / mass)
    a = more * middle
    # time from the release until the block is as fast as the belt again
    slip = 2 * (math.pi - math.atan(a * omega / speed)) / omega

    def way(t: np.ndarray) -> np.ndarray:
        first, stick = (middle + a) / speed, 2 * a / speed
        tau = np.where(t < first, -1.0, (t - first) % (slip + stick))
        phi = omega * tau
        slides = (tau >= 0) & (tau < slip)
        x = np.where(t < first, speed * t, middle - a + speed * (tau - slip))
        x = np.where(slides, middle + a * np.cos(phi) + speed / omega * np.sin(phi), x)
        v = np.where(slides, speed * np.cos(phi) - a * omega * np.sin(phi), speed)
        return np.array([x - speed * t, v - speed])

    return scene, "rub", 25.0, way


def ended(seed: int) -> tuple[sm.Scene, str, float, Way]:
    """A block with friction that bounces between compliant end stops until it comes to rest. SciPy integrates each phase
    separately."""
    rng = stream("moreau ends", seed)
    mass, mu, bound, k, d = (float(rng.uniform(*r)) for r in ((0.5, 2), (0.1, 0.3), (0.05, 0.2), (500, 4000), (0.1, 0.8)))
    speed, most = float(rng.uniform(1.0, 2.0)), mu * mass * 9.81
    rub = sm.Friction(mu=mu, half_length=0.5, half_width=0.02, half_height=0.02)
    joint = sm.Joint("prismatic", "ground", "b", axis="x", pin="outboard", friction=rub, start=sm.Start(0.0, speed),
                     end_stops=sm.EndStops(lower=-bound, upper=bound, stiffness=k, damping=d))  # fmt: skip
    scene = sm.Scene({"b": sm.Body(mass=mass, inertia=(0.1, 0.1, 0.1))}, {"rub": joint}, "ends")

    def stop(x: float, v: float) -> float:
        deep = abs(x) - bound
        return -math.copysign(k * deep * max(0.0, 1 + d * math.copysign(v, x * v)), x) if deep > 0 else 0.0

    def slides(t, y, way=1.0):
        return [y[1], (stop(*y) - way * most) / mass]

    rests, at = (lambda t, y, way: y[1]), (lambda t, y, way: abs(y[0]) - bound)
    rests.terminal = at.terminal = True
    t, y, pieces = 0.0, np.array([0.0, speed]), []
    while t < 1.0:
        way = math.copysign(1.0, y[1] if y[1] else stop(*y))
        if y[1] == 0.0 and abs(stop(*y)) <= most:
            break
        rests.direction = -way
        s = solve_ivp(slides, (t, 1.0), y, "DOP853", events=(rests, at), args=(way,), rtol=1e-12, atol=1e-14, dense_output=True)
        pieces.append((t, s.sol))
        t, y = s.t[-1], s.y[:, -1]
        if s.t_events[0].size:
            y = np.array([y[0], 0.0])
        elif t < 1.0:
            t, y = t + 1e-12, y + 1e-12 * np.array(slides(t, y, way))
    pieces.append((t, lambda _t: np.array([y[0], 0.0])))
    return scene, "rub", 1.0, lambda times: np.array([next(f for b, f in reversed(pieces) if b <= u)(u) for u in times]).T


SCENES = {
    "smooth sliding": swinging,
    **{f"stick and slip {i}": partial(belt, i) for i in range(6)},
    **{f"end stops {i}": partial(ended, i) for i in range(4)},
}  # fmt: skip


def errors(scene: sm.Scene, joint: str, until: float, way: Way) -> np.ndarray:
    """Largest error of position and rate at fifty times in the run, for each tolerance."""
    off = []
    for rtol in TOLERANCES:
        r = simulate(scene, until=until, every=until / 50, rtol=rtol, method="moreau")
        assert r.outcome.ok
        if joint == "ball":
            found = np.arctan2(r["pendulum.position[1]"], -r["pendulum.position[3]"]), -r["ball.qd[2]"]
        else:
            found = r[f"{joint}.q[1]"], r[f"{joint}.qd[1]"]
        off.append(float(np.abs(np.array(found) - way(r.time)).max()))
    return np.array(off)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.slow
def test_the_error_is_proportional_to_the_tolerance(name: str) -> None:
    off = errors(*SCENES[name]())
    assert np.all(off <= C * TOLERANCES), off
    assert np.all(np.diff(off) < 0.0), off
    slope = np.polyfit(np.log(TOLERANCES), np.log(off), 1)[0]
    assert 0.85 <= slope <= 1.15, off


def test_tighter_tolerances_take_steps_by_the_order_of_time_stepping() -> None:
    """h ∝ rtol^(1/order): a hundred times smaller error needs ten times as many steps."""
    scene, _, until, _ = swinging()
    few, many = (simulate(scene, until=until, rtol=r, method="moreau").stats.steps for r in (1e-4, 1e-8))
    assert math.log10(many / few) == pytest.approx(4 / MOREAU.order, abs=0.1)


WRONG = (({"order": 1}, "order = 2"), ({"weights": (0.5, 0.5)}, "order = 1"), ({"weights": (1, 1)}, "add up"))


@pytest.mark.parametrize(("wrong", "says"), WRONG)
def test_weights_that_do_not_bear_out_the_order_are_refused(wrong: dict, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        replace(MOREAU, **wrong)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("duty", [0.01, 0.2, 0.45])
def test_a_block_that_is_held_slips_in_every_period(duty: float) -> None:
    for rtol in (1e-3, 1e-4, 1e-6):
        r = simulate(ratchet(duty), until=50.0, every=50.0, method="moreau", rtol=rtol)
        slips = [e.time for e in r.events if e.kind == "slip"]
        assert len(slips) in (49, 50), rtol  # the first and the last period may contain no slip
        assert np.diff(slips) == pytest.approx(np.ones(len(slips) - 1), abs=0.25)  # s; while the block is held, no step is longer


@pytest.mark.slow
def test_a_shaft_whose_turn_is_fast_in_its_unit_and_passes_through_zero_continues_sliding() -> None:
    """In a tree of 5 mm the shaft travels at 3 mm/s. The direction of sliding follows from the velocity at the surface, because m/s
    and rad/s are not directly comparable."""
    r = simulate(rubbing("tree", 6).scene, until=0.05, every=0.05, method="moreau", rtol=1e-3)
    assert r.outcome.ok, r.outcome


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-6])
def test_a_pair_of_two_components_that_turns_round_is_no_jam(rtol: float) -> None:
    """The direction of sliding may reverse within a step."""
    r = simulate(CASES / "slow_pair_direction_change.yaml", until=1.0, every=1.0, method="moreau", rtol=rtol)
    assert r.outcome.ok, r.outcome
    assert [e.time for e in r.events if (e.kind, e.joint) == ("reversal", "j0")] == pytest.approx([0.7303869], abs=5 * rtol)


@pytest.mark.parametrize(("name", "until"), [("andrews", 0.002), ("cart_pole", 0.5)])
def test_the_fast_acceleration_of_a_light_body_is_no_impact(name: str, until: float) -> None:
    """The engine shortens every step that changes a speed by more than the tolerance, even the shortest step. Such a change is not
    an impact."""
    r = simulate(name, until=until, every=until, method="moreau", rtol=1e-3)
    assert r.outcome.ok, r.outcome


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("seed", "until"), [(62, 0.19), (57, 0.28)])
def test_a_follower_that_a_fast_cam_turns_round_is_no_jam(seed: int, until: float) -> None:
    """The torque makes the cam far faster than its rate at the start. The engine regards a change of speed within a certain time as
    an impact. Here the follower reverses within this time without an impact."""
    impulses, located = (simulate(crossed("cams", seed), until=until, every=until, method=m) for m in ("moreau", "rk5"))
    assert impulses.outcome.ok, impulses.outcome
    assert impulses["energy.dissipated"][-1] == pytest.approx(located["energy.dissipated"][-1], rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("rtol", [1e-7, 2e-9, 3e-9])
def test_a_step_that_ends_where_a_prescribed_motion_turns_round_stops_nobody(rtol: float) -> None:
    """At the reversal of the prescribed motion, the speed is zero, while other pairs of the loop are held. At the tolerance 2e-9, a
    step ends at this instant."""
    r = simulate(CASES / "universal_at_dead_centre.yaml", until=0.13, every=0.13, method="moreau", rtol=rtol, outputs=["k.q[1]"])
    assert [(e.kind, e.joint) for e in r.events if e.kind != "separation"] == [("reversal", "k")]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("rtol", [1e-6, 14 * 1e-10])
def test_a_joint_of_a_loop_stops_once(rtol: float) -> None:
    """Rates that are set to zero keep round-off. Over a short step, this round-off is a large acceleration. It must not change the
    modes that the search finds."""
    scene = worlds("loop_at_rest")["as it is"].scene
    r = simulate(scene, until=0.341, every=0.341, method="moreau", rtol=rtol, outputs=["j0.q[1]"])
    assert sorted(e.joint for e in r.events if e.kind == "stick") == ["j0", "j1", "jc"]
    assert {e.kind for e in r.events} == {"separation", "stick"}


def test_fixed_steps_act_on_end_stops() -> None:
    scene, _, until, way = ended(0)
    off = []
    for step in (1e-4, 1e-5):
        r = simulate(scene, until=until, every=until / 50, method="moreau", step=step)
        off.append(float(np.abs(np.array([r["rub.q[1]"], r["rub.qd[1]"]]) - way(r.time)).max()))
    assert off[1] <= 0.2 * off[0] <= 0.02  # the error is of first order


def driven_jack(seed: int) -> sm.Scene:
    """A drive turns a spindle. Its nut moves a link, which lifts a lever. The loops are redundant, and no freedom remains."""
    rng = np.random.default_rng(seed)
    x, far, high = rng.uniform(-0.02, 0.02), rng.uniform(0.09, 0.13), rng.uniform(0.1, 0.16)
    elbow = rng.uniform(0.07, 0.1)

    def pin() -> dict[str, float]:
        return {"mu": rng.uniform(0.1, 0.35), "radius": 0.012, "half_length": 0.03, "thrust_radius": 0.016}

    def bar(start: float) -> dict[str, Any]:
        angle, length = math.atan2(high, elbow - start), math.hypot(high, elbow - start)
        return {"box": [length, 0.03, 0.03], "density": 4000, "position": [0.5 * (start + elbow), 0.5 * high, 0],
                "orientation": {"axis": "z", "angle": angle}}  # fmt: skip

    revolute = {"type": "revolute", "axis": "z"}
    return scene_from_dict({
        "schema": 1, "gravity": [0, -9.81, 0],
        "bodies": {
            "spindle": {"cylinder": {"radius": 0.012, "length": 0.4, "axis": "x"}, "density": 7800, "position": [0, 0, 0]},
            "nut": {"box": [0.05] * 3, "density": 7800, "position": [x, 0, 0]}, "link": bar(x), "lever": bar(far),
        },
        "joints": {
            "bearing": {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": "spindle", "at": [0, 0, 0],
                        "friction": pin(), "drive": {"ramp": {"start": rng.uniform(-13.0, 13.0), "end": 0.0, "duration": 0.6}}},
            "thread": {"type": "screw", "axis": "x", "inboard": "spindle", "outboard": "nut", "at": [x, 0, 0], "pitch": 0.006,
                       "friction": {"mu": rng.uniform(0.1, 0.3), "radius": 0.009, "flank_angle": 0.03, "preload": 9.0}},
            "guide": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "nut", "at": [x, 0, 0]},
            "foot": {**revolute, "inboard": "nut", "outboard": "link", "at": [x, 0, 0], "friction": pin()},
            "elbow": {**revolute, "inboard": "link", "outboard": "lever", "at": [elbow, high, 0]},
            "pivot": {**revolute, "inboard": "ground", "outboard": "lever", "at": [far, 0, 0], "friction": pin()},
        },
        "simulation": {"until": 1.0},
    })  # fmt: skip


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", sampled(range(6), 2))
def test_a_mechanism_without_freedom_takes_few_steps(seed: int) -> None:
    """In the middle of a step, redundant rows are consistent only after the loops are closed. The method must close the loops at
    this point."""
    scene, exact = driven_jack(seed), simulate(driven_jack(seed), rtol=1e-8)
    assert exact.outcome.ok
    for rtol in (1e-3, 1e-4, 1e-6):
        r = simulate(scene, method="moreau", rtol=rtol, max_steps=1000)
        assert r.outcome.ok
        assert r.stats.steps <= 200  # at a tolerance of 1e-4, the run needs 60 steps
        for column in ("bearing.q[1]", "pivot.q[1]", "thread.friction.torque[1]", "foot.friction.torque[1]"):
            moves = slice(None) if ".q" in column else r.time < 0.59  # at rest friction is not unique
            assert np.abs(r[column] - exact[column])[moves].max() <= 10.0 * rtol * np.abs(exact[column]).max(), column


def lifted_from_dead_centre(seed: int) -> sm.Scene:
    """A slider-crank in its dead centre. A drive moves the piston, so that the crank could turn in either direction."""
    crank, rod, swing = np.random.default_rng(seed).uniform((0.02, 0.1, 0.01), (0.08, 0.2, 0.05))
    body, turns = {"mass": 1, "inertia": [1e-3] * 3}, {"type": "revolute", "axis": "z"}
    drive = {"harmonic": {"amplitude": swing, "frequency": 1, "phase": "90 deg", "offset": crank + rod - swing}}
    return scene_from_dict({
        "gravity": [0, 0, 0],
        "bodies": {
            "crank": body | {"points": {"pin": [crank, 0, 0]}}, "rod": body | {"points": {"end": [rod, 0, 0]}}, "piston": body,
        },
        "joints": {
            "main": {**turns, "inboard": "ground", "outboard": "crank"},
            "big": {**turns, "inboard": "crank.pin", "outboard": "rod"},
            "small": {**turns, "inboard": "rod.end", "outboard": "piston"},
            "guide": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "piston", "drive": drive},
        },
    })  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
def test_a_dead_centre_has_its_name_where_no_impulse_satisfies_the_loops(seed: int) -> None:
    """No impulse satisfies the loops at the start, so the run ends at its start."""
    scene = lifted_from_dead_centre(seed)
    for method in ("moreau", "rk5"):
        outcome = simulate(scene, until=1.0, method=method).outcome
        assert (outcome.name, outcome.time) == ("dead_centre", 0.0), method


@pytest.mark.parametrize("rtol", [1e-5, 1e-6])
def test_a_mechanism_that_rests_takes_few_steps(rtol: float) -> None:
    """Only the full search finds the loads of the stuck pairs. The run needs at most 2000 steps."""
    scene = crossed("drives_that_die", 1)
    impulses, located = (simulate(scene, method=m, rtol=rtol, max_steps=2000) for m in ("moreau", "rk8"))
    assert impulses.outcome.ok
    stops = [{e.joint: e.time for e in r.events if e.kind == "stick"} for r in (impulses, located)]
    assert stops[0] == pytest.approx(stops[1], abs=100.0 * rtol)
