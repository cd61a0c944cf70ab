"""``knocks``: where clearance would let pins cross their bearings, for how long, and how fast they would hit the other side.

A run with ideal joints says when a joint's force turns round. From there the pin is free: relative to its bearing it is driven by
the force F that the ideal joint transmits, s̈ = W F with W the mobility of the joint's point in the mechanism without it
(METHOD, "Clearance"). Exact as clearance goes to nothing; no contact dynamics follow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.joints import REGISTRY, JointKind
from engine.questions.wear import DEGREE
from engine.scene import model as sm
from engine.simulation.evaluate import evaluate
from engine.simulation.result import Result
from engine.simulation.run import Model

FREED = {1: (False, False, True), 3: (False, False, False, True, True, True)}
"""Which freedoms turn of the joint that has a hinge's or ball's turns and lets its point go across the pin, by how many turn."""
REVERSES = -0.5
"""Cosine between the forces before and after an event from which on it is told: they point at opposite sides."""
NOTHING = 1e-9
"""Of a joint's largest force: what is below has no direction."""
STEPS = 400
"""Instants of a flight that are looked at for its end, up to the next event."""

LEFT_OUT = ("friction", "ends", "effort", "spring", "damping", "stops", "latch", "motor", "wear", "start")
"""Of joints: what does not change how a force moves the mechanism."""


@dataclass(frozen=True)
class Knock:
    """A pin that crosses its bearing. time: when the force turns round, s; turn: by how much, rad; way: it crosses, m; flight: how
    long, s; speed: at which it hits the other side, along the normal there, m/s; mass: effective, kg; energy: of that speed, J.
    flight and speed are NaN where the next event comes before."""

    joint: str
    time: float
    turn: float
    way: float
    flight: float
    speed: float
    mass: float
    energy: float

    def document(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def knocks(result: Result, clearance: Mapping[str, float] | float) -> list[Knock]:
    """All knocks of a run whose rows have the contacts and coordinates of its hinges and balls (the usual columns), in their order.
    clearance: radial, m: of every hinge and ball that rubs, or by joint. SceneError for joints that are neither, for columns
    that are missing, and where rows are too few."""
    able = {n: j for n, j in result.scene.joints.items() if j.friction is not None and _freed(j)}
    asked = clearance if isinstance(clearance, Mapping) else dict.fromkeys(able, float(clearance))
    wrong = [Problem(n, "is no hinge or ball that rubs", f"of this scene are: {', '.join(able)}") for n in asked if n not in able]
    wrong += [Problem(n, f"its clearance must be positive (it is {c:g} m)") for n, c in asked.items() if not c > 0.0]
    wrong += [
        Problem("outputs", f"knocks need the column {n}.{c}", "run with all outputs of the joint")
        for n in asked if n in able for c in ("contact[1].normal_force", "contact[1].normal[3]") if f"{n}.{c}" not in result
    ]  # fmt: skip
    if wrong:
        raise SceneError(wrong)
    found = [k for name, c in asked.items() for k in _of_joint(result, name, c)]
    return sorted(found, key=lambda k: k.time)


def _freed(j: sm.Joint) -> JointKind | None:
    """The joint that stands for a hinge or ball whose point is let go; None for others."""
    kind = REGISTRY[j.type]
    turning = all(kind.turns(k) for k in range(kind.nv)) and not kind.pitched and kind.rolls is None
    wanted = FREED.get(kind.nv) if turning else None
    return next((k for k in REGISTRY.values() if tuple(map(k.turns, range(k.nv))) == wanted), None)


def _of_joint(r: Result, name: str, c: float) -> list[Knock]:
    force = _pressed(r, name)
    size = np.linalg.norm(force, axis=1)
    presses = size > NOTHING * size.max(initial=0.0)
    times = sorted({e.time for e in r.events if e.joint == name and e.kind in ("separation", "turn", "reversal")})
    ends = [*times[1:], r.time[-1]]
    out = []
    for at, end in zip(times, ends, strict=True):
        before, after = np.flatnonzero((r.time < at) & presses), np.flatnonzero((r.time > at) & (r.time <= end) & presses)
        if len(before) < 1 or len(after) < DEGREE + 1:
            continue
        n1, n2 = (f / np.linalg.norm(f) for f in (force[before[-1]], force[after[0]]))
        cosine = float(np.clip(n1 @ n2, -1.0, 1.0))
        if cosine < REVERSES:
            W = mobility(r, name, int(after[0]))
            mass = 1.0 / float(n2 @ W @ n2)
            flight, speed = _flight(r.time[after], force[after], W, c * n1, at, end)
            way = 2 * c * math.sin(math.acos(cosine) / 2)
            out.append(Knock(name, at, math.acos(cosine), way, flight, speed, mass, 0.5 * mass * speed**2))
    return out


def _pressed(r: Result, name: str) -> np.ndarray:
    """What a joint's contacts press together, N, outward on the pin, in the inboard joint frame (rows × 3)."""
    count = sum(f"{name}.contact[{i + 1}].normal_force" in r for i in range(2))
    out = np.zeros((len(r), 3))
    for c in (f"{name}.contact[{i + 1}]" for i in range(count)):
        normal = np.column_stack([r[f"{c}.normal[{k}]"] for k in (1, 2, 3)])
        out += np.nan_to_num(r[f"{c}.normal_force"][:, None] * normal)
    return out


def mobility(r: Result, name: str, row: int) -> np.ndarray:
    """Relative acceleration of a joint's two points per force between them, were they free, m/s² per N (3×3, inboard joint frame;
    along the axis of a hinge none)."""
    j = r.scene.joints[name]
    free = _freed(j)
    assert free is not None, name
    ways = [k for k in range(free.nv) if not free.turns(k)]
    axes = [free.axes[k][0].index for k in ways]
    bare: dict[str, Any] = dict.fromkeys(LEFT_OUT)
    joints = {n: replace(x, **bare) for n, x in r.scene.joints.items()}
    q = {n: [r[c][row] for c in r.matching(f"{n}.q[*]")] for n in joints}
    q[name] = [0.0] * len(ways) + q[name]
    out, none = np.zeros((3, 3)), np.zeros(len(ways))
    for k in (None, *ways):
        effort = tuple(1.0 if i == k else 0.0 for i in range(free.nv))
        own = replace(joints[name], type=free.name, effort=effort, drive=None, cut=False)
        scene = replace(r.scene, joints=joints | {name: own}, forces={}, gravity=(0.0, 0.0, 0.0))
        found = evaluate(Model(scene, (f"{name}.qdd[*]",)), q, {}, float(r.time[row]))
        a = np.array([found[f"{name}.qdd[{i + 1}]"] for i in ways])
        if k is None:
            none = a
        else:
            out[axes, axes[ways.index(k)]] = a - none
    return out


def _flight(time: np.ndarray, force: np.ndarray, W: np.ndarray, s0: np.ndarray, at: float, end: float) -> tuple[float, float]:
    """(how long, and how fast along the normal there) a point goes from s0 to the circle through it, driven by W F."""
    from scipy.interpolate import make_interp_spline
    from scipy.optimize import brentq

    driven = make_interp_spline(time, force @ W.T, k=min(DEGREE, len(time) - 1))
    rate, way = driven.antiderivative(1), driven.antiderivative(2)

    def speed(t: float) -> np.ndarray:
        return np.asarray(rate(t) - rate(at))

    def place(t: float) -> np.ndarray:
        return np.asarray(s0 + way(t) - way(at) - rate(at) * (t - at))

    def outside(t: float) -> float:
        s = place(t)
        return float((s - s0) @ (s + s0))  # |s|² − |s0|², without cancelling

    ts = at + (end - at) * np.linspace(0.0, 1.0, STEPS + 1)[1:] ** 3  # short flights are looked at closely
    inside = False
    for before, t in pairwise(ts):
        inside |= outside(before) < 0.0
        if inside and outside(t) >= 0.0:
            hit = float(brentq(outside, before, t, xtol=1e-16))
            return hit - at, float(speed(hit) @ place(hit)) / float(np.linalg.norm(s0))
    return math.nan, math.nan
