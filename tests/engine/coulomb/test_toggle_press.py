"""A press folds through its change point. Where friction has two roots near this point, the run follows the root that stiff
contacts would keep. Where no root exists, the press jams. A model with a spring at the foot agrees at every setting."""

from __future__ import annotations

from functools import cache, partial
from itertools import product

import numpy as np
import pytest

from tests.default_case_selection import sampled
from tests.reference.contact_and_friction.sprung_toggle_press import SprungToggle
from trunnion.scene import scene_from_text
from trunnion.simulation.results.event import Event
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

METHODS = ("auto", "rk5", "rk8", "rosenbrock", "moreau")
TOLERANCES = (1e-5, 6.3e-6, 4e-6, 1e-6, 1e-7, 2.5e-8, 1e-8, 1e-9, 1e-10)
PUSH_TIMES, PUSH = [0, 0.5, 1.0, 1.01, 2.0], [500, 800, 800, 0, 0]
OTHERS = [(0.05, 20, 1100), (0.1, 20, 1100), (0.1, 10, 800), (0.2, 20, 1100)]
"""Other presses that jam on their way back: μ, radius of the pins in mm, largest push in N."""
CROSSING = {"auto": 2e-7, "rk5": 2e-7, "rk8": 2e-7, "rosenbrock": 2e-7, "moreau": 4e-5}
"""Error in time, s, that the passage through the change point may cause in later events. Near this point the engine leaves out one
row of the loops for 4e-5 s, and forces jump where this interval begins and ends."""

TOGGLE = """
schema: 1
name: toggle
gravity: [0, 0, -9.81]
ground:
  points: {crown: [0, 0, 1.0], bed: [0, 0, 0]}
bodies:
  upper: {box: [60 mm, 60 mm, 300 mm], density: 7800, center: [0, 0, -150 mm], points: {knee: [0, 0, -300 mm]}}
  lower: {box: [60 mm, 60 mm, 300 mm], density: 7800, center: [0, 0, -150 mm], points: {foot: [0, 0, -300 mm]}}
  ram: {box: [200 mm, 200 mm, 100 mm], density: 7800, center: [0, 0, -50 mm]}
joints:
  crown: {type: revolute, axis: y, inboard: ground.crown, outboard: upper, RUB, start: {q: 30 deg, qd: 0}}
  knee: {type: revolute, axis: y, inboard: upper.knee, outboard: lower, RUB, start: {q: -60 deg}}
  foot: {type: revolute, axis: y, inboard: lower.foot, outboard: ram, RUB}
  slide: {type: prismatic, axis: z, inboard: ground.bed, outboard: ram, end_stops: {stiffness: 5e6, lower: 0.405, damping: 0.2}}
forces:
  push: {type: force, on: upper.knee, force: [{table: {time: TIMES, value: PUSH}}, 0, 0]}
simulation: {until: 2 s, every: 1 ms}
"""


@cache
def run(method: str, rtol: float, mu: float = 0.1, radius: float = 20, push: float = 800) -> Result:
    text = TOGGLE.replace("RUB", f"friction: {{mu: {mu}, radius: {radius} mm, half_length: 30 mm}}")
    scene = scene_from_text(text.replace("TIMES", str(PUSH_TIMES)).replace("PUSH", str([push / 800 * f for f in PUSH])))
    return simulate(scene, method=method, rtol=rtol, outputs=["crown.q[1]", "crown.qd[1]"])


def told(r: Result) -> list[Event]:
    """The run's events without separations, and without contact jumps at the instant of the jam. The instant at which pin and
    bearing separate depends on the steps. At the jam the forces are unbounded, and round-off decides whether contacts jump before
    the jam (by 1e-13 s)."""
    end = r.outcome.time - 1e-9
    return [e for e in r.events if e.kind != "separation" and not (e.kind == "contact_jump" and e.time > end)]


def sprung(stiffness: float, begin: float, end: float):
    """The motion of the press with its foot on a spring, from the engine's state at `begin`."""
    ours = run("rk8", 1e-10)
    at = int(np.searchsorted(ours.time, begin - 1e-9))
    model = SprungToggle(stiffness, 100 * np.sqrt(stiffness), partial(np.interp, xp=PUSH_TIMES, fp=PUSH))
    return model.run(begin, end, ours["crown.q[1]"][at], ours["crown.qd[1]"][at])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("method", sampled(METHODS, 4))
def test_the_press_folds_through_and_jams_on_its_way_back_at_every_setting(method: str) -> None:
    for rtol in TOLERANCES:
        r = run(method, rtol)
        assert r.outcome.name == "jammed", rtol
        assert [e.kind for e in told(r)] == ["end_stop_engaged", "end_stop_released"] + ["reversal"] * 3, rtol
        assert r.outcome.time == pytest.approx(0.5378174, abs=100 * rtol + CROSSING[method]), rtol
        assert told(r)[-1].time == pytest.approx(0.4825039, abs=100 * rtol + CROSSING[method]), rtol


PRESSES = [(*press, half) for press in OTHERS for half in (0, 1)]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("mu", "radius", "push", "half"), sampled(PRESSES, lambda p: p[3] == OTHERS.index(p[:3]) % 2))
def test_presses_that_jam_have_the_same_events_at_every_setting(mu: float, radius: float, push: float, half: int) -> None:
    """By default, each press runs at every second setting. Two of the presses then run at each setting."""
    exact = run("rk8", 1e-10, mu, radius, push)
    for method, rtol in list(product(("rk5", "rk8", "rosenbrock"), TOLERANCES))[half::2]:
        r, off = run(method, rtol, mu, radius, push), 100 * rtol + CROSSING[method]
        assert r.outcome.name == exact.outcome.name == "jammed", (method, rtol)
        assert r.outcome.joint == exact.outcome.joint, (method, rtol)
        assert r.outcome.time == pytest.approx(exact.outcome.time, abs=off), (method, rtol)
        assert [e.kind for e in told(r)] == [e.kind for e in told(exact)], (method, rtol)
        assert [e.time for e in told(r)] == pytest.approx([e.time for e in told(exact)], abs=off), (method, rtol)


@pytest.mark.slow
def test_a_springy_foot_folds_through_as_well_and_turns_back_where_ours_does() -> None:
    turned = next(e for e in run("rk8", 1e-10).events if e.kind == "reversal").time
    motion = sprung(1e10, 0.425, 0.49)
    assert motion.status == 0
    before, behind = motion.sol(turned - 5e-4)[2], motion.sol(turned + 5e-4)[2]
    assert before < 0.0 < behind
    # the engine's value, without the energy that the spring's oscillation loses
    assert motion.sol(0.46)[2] == pytest.approx(-0.41692, abs=0.01)


@pytest.mark.slow
def test_on_its_way_back_a_stiff_foot_stops_where_ours_jams() -> None:
    """The force on the foot grows beyond all bounds, and friction grows with it. A stiffer spring at the foot shortens the travel
    of this growth."""
    end = run("rk8", 1e-10).outcome.time
    for stiffness, late in ((1e17, 2e-4), (1e19, 8e-5)):
        motion = sprung(stiffness, 0.53, end + late)
        assert motion.sol(end - 5e-5)[2] > 0.8, stiffness
        assert abs(motion.sol(end + late)[2]) < 1e-3, stiffness
