"""Rows of the gallery about many joints with friction on few freedoms: the corner of a car, and a platform on sprung legs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
from scipy.optimize import brentq

from tests.engine.coulomb.test_many_joints_one_freedom import ALL, corner
from tests.engine.mechanisms.stewart_platform import stewart
from tests.reference import solve
from tests.reference.states_from_columns import state_at
from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import honest, ran
from trunnion.analysis.static_bounds.start_pose_statics import hold
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

SLOW = 1e-6
"""Rate of a mechanism, rad/s or m/s, that is so slow that its value does not matter: its square is 1e-12."""
ROUND_OFF = 1e-12
"""Round-off of rates that loops leave at rest, rad/s or m/s. A joint that is released at one part in a million has a hundred
thousand times this rate."""


def wishbone(load: float, rate: float = 0.0) -> sm.Scene:
    """The corner of a car, five joints of which have friction on one freedom, under a wheel's load in N."""
    scene = corner(ALL)
    joints = scene.joints | {
        "lower_in": replace(scene.joints["lower_in"], start=sm.Start(0.0, rate)),
        "upper_in": replace(scene.joints["upper_in"], start=None),
    }
    road = sm.Force("force", "knuckle.patch", (0.0, 0.0, load))
    until = sm.Simulation(until=0.01)
    return replace(scene, joints=joints, forces=scene.forces | {"road": road}, simulation=until, outputs=("*",))


def platform(legs: int, until: float, rate: float = 0.0) -> sm.Scene:
    """A platform on sprung legs with friction in all joints. The platform is at rest, or all its legs grow at a rate in m/s."""
    scene = stewart(legs)
    joints = {n: replace(j, start=replace(j.start, qd=rate)) if n.startswith("leg") else j for n, j in scene.joints.items()}
    return replace(scene, joints=joints, simulation=sm.Simulation(until=until), outputs=("*",))


@cache
def most(scene: Callable[[float, float], sm.Scene], joint: str, low: float, high: float) -> float:
    """The load (N) beyond which all joints continue to slide. At this load, a slow mechanism neither slows down nor speeds up. The
    formulation that shares no code with the engine gives the load. The engine gives only the start with closed loops."""
    start = simulate(scene(low, SLOW), until=1e-9, every=1e-9)
    at = state_at(start, 0)

    def speeding(load: float) -> float:
        return float(solve(replace(at, scene=scene(load, SLOW))).qdd[joint][0])

    return float(brentq(speeding, low, high, xtol=1e-12 * high, rtol=1e-14))


def lifted(beyond: float, rate: float = 0.0) -> sm.Scene:
    """The corner whose wheel carries (1 + ``beyond``) times the reference load."""
    return wishbone((1 + beyond) * most(wishbone, "lower_in", 4000.0, 6000.0), rate)


def rests(scene: sm.Scene) -> str:
    """The word "holds" or "slips" by statics. If a short run contradicts statics, also the result of this run."""
    word, r = "holds" if hold(scene).holds else "slips", ran(scene)
    still = max(np.abs(r[c]).max() for c in r.matching("*.qd[*]")) <= ROUND_OFF and not r.events
    return word if (word == "holds") == still and r.outcome.ok else f"{word}, but the run {r.outcome.name}"


def going(scene: sm.Scene, joint: str) -> str:
    """Verdict on whether the mechanism slows down or speeds up."""
    r = ran(scene, rows=1)
    rate, change = r[f"{joint}.qd[1]"][0], r[f"{joint}.qdd[1]"][0]
    return r.outcome.name if not r.outcome.ok else "speeds up" if change * rate > 0 else "slows down"


def dense(scene: sm.Scene) -> str:
    """The words "as by dense equations" if all accelerations at the start equal the accelerations by the formulation that shares no
    code with the engine."""
    r = simulate(scene, until=1e-9, every=1e-9)
    other = solve(state_at(r, 0)).qdd
    pairs = [(r[f"{n}.qdd[{k + 1}]"][0], x) for n, each in other.items() for k, x in enumerate(each)]
    off = max(abs(a - b) for a, b in pairs) / max(abs(b) for _, b in pairs)
    return "as by dense equations" if r.outcome.ok and off <= 1e-9 else f"{r.outcome.name}, {off:.1e} off"


ROWS = (
    Row(26, "wishbone", "five joints with friction on one freedom", (
        Edge("wheel load at which all joints slide", lifted, rests, "holds", "slips"),
        Edge("the same while it moves", lambda b: lifted(b, SLOW), partial(going, joint="lower_in"), "slows down", "speeds up"),),
        "hundreds of events, other ones at every tolerance"),
    Row(27, "stewart", "a platform on six legs, friction in all joints", (
        Edge("from rest, 0.3 s", lambda _: platform(6, 0.3), honest, "right", slow=True),
        Edge("all legs extending, 36 frictional freedoms", lambda _: platform(6, 1e-3, 0.1), dense, "as by dense equations",
             slow=True),
        Edge("from rest on three legs, 0.3 s", lambda _: platform(3, 0.3), honest, "right"),
        Edge("three legs extending", lambda _: platform(3, 1e-3, 0.1), dense, "as by dense equations"),),
        "one turn of a pair after the other: minutes for a millisecond"),
)  # fmt: skip
