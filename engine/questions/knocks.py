"""``knocks``: where clearance would let pins cross their bearings, for how long, and how fast they would hit the other side.

A run with ideal joints says which force R a joint transmits. With clearance its pin lies where that presses it, and is driven along
the bearing or away from it by s̈ = W R, W being the mobility of the joint's point in the mechanism without it (METHOD, "Clearance").
Exact as clearance goes to nothing; no contact dynamics follow."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from engine.basics.extras import brought
from engine.basics.problems import Problem, SceneError
from engine.joints import REGISTRY, JointKind
from engine.scene import model as sm
from engine.simulation.evaluate import evaluate
from engine.simulation.result import Result
from engine.simulation.run import Model

FREED = {1: (False, False, True), 3: (False, False, False, True, True, True)}
"""Which freedoms turn of the joint that has a hinge's or ball's turns and lets its point go across the pin, by how many turn."""
PLANES = {1: (2, 1), 3: (0, 2)}
"""Axes along which the cosine and the sine of a contact's angle are, of a hinge and of a ball, by how many turn."""
REVERSES = 0.0
"""Cosine between what drives a pin before and after a dip below which it may cross: to the other half of its bearing."""
NEAR = 0.2
"""Of what drives a pin on both sides of a dip: below it the pin is followed."""
LEAST = 8
"""Rows between two tops of what drives a pin below which a dip is not looked at."""
STEPS = 400
"""Instants of a flight that are looked at for its end, up to where it is driven hardest."""
ROUND_OFF = 1e-9
"""Of the square of the clearance: so far inside it is off its side."""
ACROSS = 1.0
"""Of the clearance: the shortest way that is a crossing, a sixth of the way round."""
FINE = 1e-9
"""Relative tolerance of the motion along a bearing."""
DEGREE = 5
"""Of the splines through what drives a pin."""
USE = "what follows pins through their clearance"
LEFT_OUT = ("friction", "ends", "effort", "spring", "damping", "stops", "latch", "motor", "wear", "start")
"""Of joints: what does not change how a force moves the mechanism."""


@dataclass(frozen=True)
class Knock:
    """A pin that crosses its bearing. time: when it leaves its side, s; turn: how far around the bearing it comes, rad; way: it
    crosses, m; flight: how long, s; speed: at which it hits the other side, along the normal there, m/s; mass: effective, kg;
    energy: of that speed, J; normal: outward on the pin where it hits (3, inboard joint frame), to which that of the ideal joint's
    contact goes as the clearance does to nothing; angle: of it, as those of contacts are, there, rad."""

    joint: str
    time: float
    turn: float
    way: float
    flight: float
    speed: float
    mass: float
    energy: float
    normal: tuple[float, float, float]
    angle: float

    def document(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def knocks(result: Result, clearance: Mapping[str, float] | float) -> list[Knock]:
    """All knocks of a run whose rows have coordinates and reactions of its hinges and balls (the usual columns), in their order.
    clearance: radial, m: of every hinge and ball, or by joint. SceneError for joints that are neither, and for columns that are
    missing."""
    able = {n: j for n, j in result.scene.joints.items() if _freed(j)}
    asked = clearance if isinstance(clearance, Mapping) else dict.fromkeys(able, float(clearance))
    hint = f"hinges and balls of this scene are: {', '.join(able)}" if able else "this scene has neither hinges nor balls"
    wrong = [Problem(n, _why_not(result.scene.joints.get(n)), hint) for n in asked if n not in able]
    wrong += [Problem(n, f"its clearance must be positive (it is {c:g} m)") for n, c in asked.items() if not c > 0.0]
    needed = [f"{n}.{c}" for n in asked if n in able for c in ("reaction.force[1]", "reaction.force[3]", "q[1]")]
    hint = "run with all outputs of joints"
    wrong += [Problem("outputs", f"knocks need the column {c}", hint) for c in needed if c not in result]
    if wrong:
        raise SceneError(wrong)
    found = [k for name, c in asked.items() for k in _of_joint(result, name, c)]
    return sorted(found, key=lambda k: k.time)


def _why_not(j: sm.Joint | None) -> str:
    """Why no clearance of a joint can be asked about: none of its kind lets its point go and keeps its other freedoms."""
    if j is None:
        return "is no joint of this scene"
    kind = REGISTRY[j.type]
    if not kind.friction:
        return f"has no contacts ({j.type} joints have none), and so no clearance"
    return f"is a {j.type} joint, not a hinge or a ball: how its pin crosses a clearance is not followed"


def _freed(j: sm.Joint) -> JointKind | None:
    """The joint that stands for a hinge or ball whose point is let go; None for others."""
    kind = REGISTRY[j.type]
    turning = all(kind.turns(k) for k in range(kind.nv)) and not kind.pitched and kind.rolls is None
    wanted = FREED.get(kind.nv) if turning else None
    return next((k for k in REGISTRY.values() if tuple(map(k.turns, range(k.nv))) == wanted), None)


def _of_joint(r: Result, name: str, c: float) -> list[Knock]:
    """What happens at each dip of what drives a joint's pin."""
    force = np.column_stack([r[f"{name}.reaction.force[{k}]"] for k in (1, 2, 3)])
    size, moves = np.linalg.norm(force, axis=1), mobility(r, name)
    tops = [0, *(i for i in range(1, len(r) - 1) if size[i - 1] < size[i] >= size[i + 1]), len(r) - 1]
    out = []
    for first, last in pairwise(tops):
        if last - first < LEAST:
            continue
        low = first + int(np.argmin(size[first : last + 1]))
        W = moves(low)
        driven = force[first : last + 1] @ W.T
        both = np.linalg.norm(driven[[0, -1]], axis=1)
        if not both.min() > 0.0 or driven[0] @ driven[-1] / both.prod() > REVERSES:
            continue
        weak = np.flatnonzero(np.linalg.norm(driven, axis=1) < NEAR * both.min())
        begin = r.time[first + max(int(weak[0]) - 1, 0)] if weak.size else r.time[first]
        found = _crossing(r.time[first : last + 1], driven, c, float(begin))
        if found is not None:  # else it goes along its bearing, and leaves that for less than it is deep
            at, flight, speed, s0, s1 = found
            way, n = float(np.linalg.norm(s1 - s0)), s1 / c
            mass = 1.0 / float(n @ W @ n)
            turn = 2 * math.asin(min(way / (2 * c), 1.0))
            normal = -n if r.scene.joints[name].pin == "inboard" else n
            cos, sin = (normal[k] for k in PLANES[len(r.matching(f"{name}.qd[*]"))])
            energy, hits = 0.5 * mass * speed**2, (float(normal[0]), float(normal[1]), float(normal[2]))
            out.append(Knock(name, at, turn, way, flight, speed, mass, energy, hits, math.atan2(sin, cos)))
    return out


def mobility(r: Result, name: str) -> Callable[[int], np.ndarray]:
    """In a row the relative acceleration of a joint's two points per force between them, were they free, m/s² per N (3×3, inboard
    joint frame; along the axis of a hinge none)."""
    free = _freed(r.scene.joints[name])
    assert free is not None, name
    ways = [k for k in range(free.nv) if not free.turns(k)]
    axes = [free.axes[k][0].index for k in ways]
    bare: dict[str, Any] = dict.fromkeys(LEFT_OUT)
    joints = {n: replace(x, **bare) for n, x in r.scene.joints.items()}
    models = []
    for k in (None, *ways):
        effort = tuple(1.0 if i == k else 0.0 for i in range(free.nv))
        own = replace(joints[name], type=free.name, effort=effort, drive=None, cut=False)
        scene = replace(r.scene, joints=joints | {name: own}, forces={}, gravity=(0.0, 0.0, 0.0))
        models.append(Model(scene, (f"{name}.qdd[*]",)))

    def at(row: int) -> np.ndarray:
        q = {n: [r[c][row] for c in r.matching(f"{n}.q[*]")] for n in joints}
        q[name] = [0.0] * len(ways) + q[name]
        found = [evaluate(m, q, {}, float(r.time[row])) for m in models]
        each = np.array([[f[f"{name}.qdd[{k + 1}]"] for k in ways] for f in found])
        out = np.zeros((3, 3))
        out[np.ix_(axes, axes)] = (each[1:] - each[0]).T
        return out

    return at


def _crossing(
    time: np.ndarray, driven: np.ndarray, c: float, begin: float
) -> tuple[float, float, float, np.ndarray, np.ndarray] | None:
    """Of a pin that lies at ``begin`` where it is driven, critically damped along its bearing: when it leaves that, how long it
    flies and how fast it hits along the normal, and its places then (3 each, m); None where it does not cross."""
    solve_ivp = brought("scipy.integrate", "analysis", USE).solve_ivp
    make_interp_spline = brought("scipy.interpolate", "analysis", USE).make_interp_spline

    a = make_interp_spline(time, driven, k=min(DEGREE, len(time) - 1))
    start = np.asarray(a(begin))
    e1 = start / np.linalg.norm(start)
    across = driven[-1] - (driven[-1] @ e1) * e1
    size = float(np.linalg.norm(across))
    spare = np.eye(3)[int(np.argmin(np.abs(e1)))]
    e2 = across / size if size > 0.0 else np.cross(e1, spare) / np.linalg.norm(np.cross(e1, spare))

    def place(y: np.ndarray) -> np.ndarray:
        return np.asarray(math.cos(y[0]) * e1 + math.sin(y[0]) * e2)

    def along(y: np.ndarray) -> np.ndarray:
        return np.asarray(math.cos(y[0]) * e2 - math.sin(y[0]) * e1)

    def slopes(t: float, y: np.ndarray) -> list[float]:
        now = np.asarray(a(t))
        return [y[1], float(now @ along(y)) / c - 2 * math.sqrt(float(np.linalg.norm(now)) / c) * y[1]]

    def leaves(t: float, y: np.ndarray) -> float:
        return float(a(t) @ place(y)) + c * y[1] ** 2

    leaves.terminal, leaves.direction = True, -1.0  # type: ignore[attr-defined]
    run = solve_ivp(slopes, (begin, time[-1]), [0.0, 0.0], events=leaves, rtol=FINE, atol=FINE, max_step=(time[-1] - begin) / STEPS)
    if not run.t_events[0].size:
        return None
    at, y = float(run.t_events[0][0]), run.y_events[0][0]
    s0, v0 = c * place(y), c * y[1] * along(y)
    flight, speed, s1 = _flight(a, s0, v0, at, float(time[-1]))
    return (at, flight, speed, s0, s1) if float(np.linalg.norm(s1 - s0)) > ACROSS * c else None


def _flight(a: Any, s0: np.ndarray, v0: np.ndarray, at: float, end: float) -> tuple[float, float, np.ndarray]:
    """(how long, how fast along the normal there, where) a point goes from s0 with v0 to the circle through it, driven by a(t)."""
    brentq = brought("scipy.optimize", "analysis", USE).brentq

    rate, way = a.antiderivative(1), a.antiderivative(2)

    def moved(t: float) -> np.ndarray:
        return np.asarray(v0 * (t - at) + way(t) - way(at) - rate(at) * (t - at))

    def outside(t: float) -> float:
        return float(moved(t) @ (moved(t) + 2 * s0))  # |s|² − |s0|², without cancelling

    inside = False
    ts = at + (end - at) * np.linspace(0.0, 1.0, STEPS + 1)[1:] ** 3  # short flights are looked at closely
    for before, t in pairwise(ts):
        inside |= outside(before) < -ROUND_OFF * float(s0 @ s0)
        if inside and outside(t) >= 0.0:
            hit = float(brentq(outside, before, t, xtol=1e-16))
            s1 = s0 + moved(hit)
            return hit - at, float((v0 + rate(hit) - rate(at)) @ s1) / float(np.linalg.norm(s0)), s1
    return math.nan, math.nan, np.full(3, math.nan)
