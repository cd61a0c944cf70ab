"""``knocks``: crossings of parts through the clearance of their joints, and the speeds of the impacts on the other side.

Source: theory, "Clearance". A run with ideal joints gives the force R that a joint transmits. In a joint with clearance, R presses
the pin against its bearing. The pin moves by s̈ = W R, where W is the mobility of the joint's point in the mechanism without the
joint. The result is exact in the limit of vanishing clearance. Contact dynamics are not modelled.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np

from trunnion.analysis.mechanics.joint_clearances import (
    clearances_of,
    directions,
    frame_of,
    free_mobility,
    restrict_mobility,
    rotation_at,
)
from trunnion.basics.errors import Problem, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.optional_packages import brought
from trunnion.elements.contact.clearance import Play
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result

REVERSES = 0.0
"""A pin crosses its bearing at a dip of the reaction force only if the direction of the pin's acceleration changes enough. The
cosine of the angle between the directions before and after the dip must be below this value."""
NEAR = 0.2
"""Integration of the motion along the bearing begins when the pin's acceleration falls below this fraction of its value at the ends
of the dip (of the smaller value)."""
LEAST = 8
"""Least number of rows between the two maxima of the force beside a dip. A dip with fewer rows is not resolved and is skipped."""
STEPS = 400
"""Number of instants of a flight that are checked for the impact."""
ROUND_OFF = 1e-9
"""The pin has left its side if c² − |s|² exceeds this value times c² (s: position of the pin, c: clearance)."""
ACROSS = 1.0
"""Shortest crossing that counts, in multiples of the clearance: the chord of a sixth of the circle."""
STRAIGHT = 1e-9
"""The pin's acceleration counts as reversing along a straight line if its last value deviates little from the line of its first
value: by less than this fraction of its size."""
FINE = 1e-9
"""Relative tolerance for the motion along a bearing."""
DEGREE = 5
"""Degree of the splines through the pin's acceleration."""
USE = "the motion of pins through their clearance"


@dataclass(frozen=True)
class ClearanceImpact:
    """A crossing of a pin through its bearing, which ends with an impact.

    Attributes:
        joint: name of the joint.
        time: time at which the pin leaves its side, s.
        turn: angle around the bearing from the departure to the impact, rad.
        way: distance between the points of departure and impact, m.
        flight: duration of the crossing, s.
        speed: normal component of the speed at the impact, m/s.
        mass: effective mass along the normal, kg.
        energy: kinetic energy of ``mass`` at ``speed``, J.
        normal: outward normal on the pin at the impact (3, inboard joint frame).
        angle: angle of the normal, rad, defined as in the columns of contacts.
        part: number of the clearance in the joint. Sleeve: 1 along e2, 2 along e3. Universal joint: number of the journal.
    """

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
    part: int = 1

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers."""
        return asdict(self)


def knocks(result: Result, clearance: Mapping[str, float] | float) -> list[ClearanceImpact]:
    """All knocks of a run, ordered by time.

    The result needs the coordinates and reactions of the joints, which the default outputs contain.

    Args:
        result: the run.
        clearance: radial clearance (for a sleeve: half its lateral play), m: one value for all revolute, cylindrical, spherical,
            prismatic and universal joints, or {joint: value}.

    Raises:
        SceneError: for joints of other types, clearances that are not positive, and missing columns.
    """
    able = {n: j for n, j in result.scene.joints.items() if clearances_of(j)}
    asked = clearance if isinstance(clearance, Mapping) else dict.fromkeys(able, float(clearance))
    hint = f"joints with clearances in this scene: {', '.join(able)}" if able else "this scene has no joints with clearances"
    wrong = [Problem(n, _why_not(result.scene.joints.get(n)), hint) for n in asked if n not in able]
    wrong += [Problem(n, f"its clearance must be positive (it is {c:g} m)") for n, c in asked.items() if not c > 0.0]
    needed = [f"{n}.{c}" for n in asked if n in able for c in ("reaction.force[1]", "reaction.force[3]", "q[1]")]
    hint = "run with all outputs of joints"
    wrong += [Problem("outputs", f"knocks need the column {c}", hint) for c in needed if c not in result]
    raise_problems(wrong)
    found = [k for name, c in asked.items() for k in _find_impacts(result, name, c)]
    return sorted(found, key=lambda k: k.time)


def _why_not(j: sm.Joint | None) -> str:
    """The reason why ``knocks`` cannot analyse a joint's clearance."""
    if j is None:
        return "is not a joint of this scene"
    kind = REGISTRY[j.type]
    if not kind.friction:
        return f"has no contacts ({j.type} joints have none), and so no clearance"
    return f"is a {j.type} joint: crossings of its clearance cannot be computed"


def _find_impacts(r: Result, name: str, c: float) -> list[ClearanceImpact]:
    """The impacts in all clearances of a joint. c: clearance, m."""
    force = np.column_stack([r[f"{name}.reaction.force[{k}]"] for k in (1, 2, 3)])
    turned, free, known = [rotation_at(r, name, i) for i in range(len(r))], free_mobility(r, name), dict[int, np.ndarray]()
    out = []
    for number, play in enumerate(clearances_of(r.scene.joints[name]), 1):
        frames = np.array([frame_of(play, R) for R in turned])
        acts = np.einsum("nji,nj->ni", frames, force)
        acts[:, [k for k in range(3) if k not in play.axes]] = 0.0
        for first, low, last in _dips(np.linalg.norm(acts, axis=1)):
            if low not in known:
                known[low] = free(low)
            W = frames[low].T @ restrict_mobility(known[low], play, turned[low]) @ frames[low]
            found = _cross_dip(r.time[first : last + 1], acts[first : last + 1] @ W.T, c)
            if found is not None:
                out.append(_impact(r, name, number, play, W, c, found))
    return out


def _dips(size: np.ndarray) -> Iterator[tuple[int, int, int]]:
    """For each dip of a force's size, three rows: the maximum before the dip, the least force, and the maximum after the dip."""
    tops = [0, *(i for i in range(1, len(size) - 1) if size[i - 1] < size[i] >= size[i + 1]), len(size) - 1]
    for first, last in pairwise(tops):
        if last - first >= LEAST:
            yield first, first + int(np.argmin(size[first : last + 1])), last


def _cross_dip(time: np.ndarray, driven: np.ndarray, c: float) -> tuple[float, float, float, np.ndarray, np.ndarray] | None:
    """The crossing in a dip, in the form that ``_crossing`` returns. driven (n×3): acceleration of the pin, m/s²."""
    both = np.linalg.norm(driven[[0, -1]], axis=1)
    if not both.min() > 0.0 or driven[0] @ driven[-1] / both.prod() > REVERSES:
        return None
    weak = np.flatnonzero(np.linalg.norm(driven, axis=1) < NEAR * both.min())
    begin = time[max(int(weak[0]) - 1, 0)] if weak.size else time[0]
    return _crossing(time, driven, c, float(begin))


def _impact(
    r: Result, name: str, part: int, play: Play, W: np.ndarray, c: float,
    found: tuple[float, float, float, np.ndarray, np.ndarray],
) -> ClearanceImpact:  # fmt: skip
    """The impact of a crossing. W: mobility in the frame of the bearing."""
    at, flight, speed, s0, s1 = found
    way, n = float(np.linalg.norm(s1 - s0)), s1 / c
    mass = 1.0 / float(n @ W @ n)
    turn = 2 * math.asin(min(way / (2 * c), 1.0))
    hit = at + (0.0 if math.isnan(flight) else flight)
    R = rotation_at(r, name, int(np.argmin(np.abs(r.time - hit))))
    normal = frame_of(play, R) @ n * (-1.0 if (r.scene.joints[name].pin == "inboard") != play.swaps else 1.0)
    cos, sin = normal @ directions(play.angle, R)
    hits = (float(normal[0]), float(normal[1]), float(normal[2]))
    return ClearanceImpact(name, at, turn, way, flight, speed, mass, 0.5 * mass * speed**2, hits, math.atan2(sin, cos), part)


def _crossing(
    time: np.ndarray, driven: np.ndarray, c: float, begin: float
) -> tuple[float, float, float, np.ndarray, np.ndarray] | None:
    """(time of departure, duration of the flight, normal speed at the impact, position at departure, position at impact). Positions
    (3) are in m.

    None if the pin does not cross. time (n): s; driven (n × 3): acceleration of the pin, m/s²; c: clearance, m; begin: time, s, at
    which the pin still rests on its side. From this time on, the pin's motion along the bearing is critically damped.
    """
    solve_ivp = brought("scipy.integrate", "analysis", USE).solve_ivp
    make_interp_spline = brought("scipy.interpolate", "analysis", USE).make_interp_spline

    a = make_interp_spline(time, driven, k=min(DEGREE, len(time) - 1))
    start = np.asarray(a(begin))
    e1 = start / np.linalg.norm(start)
    across = driven[-1] - (driven[-1] @ e1) * e1
    if np.linalg.norm(across) <= STRAIGHT * np.linalg.norm(driven[-1]):
        across = np.cross(e1, np.eye(3)[int(np.argmin(np.abs(e1)))])
    e2 = across / np.linalg.norm(across)

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
    """(duration, normal speed, position) at the end of a flight inside the circle through s0. The flight starts at s0 with velocity
    v0 and has acceleration a(t).

    NaN if the point does not reach the circle before ``end``.
    """
    brentq = brought("scipy.optimize", "analysis", USE).brentq

    rate, way = a.antiderivative(1), a.antiderivative(2)

    def moved(t: float) -> np.ndarray:
        return np.asarray(v0 * (t - at) + way(t) - way(at) - rate(at) * (t - at))

    def outside(t: float) -> float:
        return float(moved(t) @ (moved(t) + 2 * s0))  # |s|² − |s0|² in a form without cancellation

    inside = False
    ts = at + (end - at) * np.linspace(0.0, 1.0, STEPS + 1)[1:] ** 3  # the first instants are denser, to resolve short flights
    for before, t in pairwise(ts):
        inside |= outside(before) < -ROUND_OFF * float(s0 @ s0)
        if inside and outside(t) >= 0.0:
            hit = float(brentq(outside, before, t, xtol=1e-16))
            s1 = s0 + moved(hit)
            return hit - at, float((v0 + rate(hit) - rate(at)) @ s1) / float(np.linalg.norm(s0)), s1
    return math.nan, math.nan, np.full(3, math.nan)
