"""Bands: ranges of a coordinate in which friction holds a mechanism at rest (theory, "Rest, swings and efforts")."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from trunnion.analysis.mechanics.mechanism_at_rest import MechanismAtRest, open_contacts
from trunnion.analysis.static_bounds.start_pose_statics import STILL, accelerating_joints, hold_drives
from trunnion.analysis.studies.root_bracket import bracketed_root
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.abi import Status
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.friction_pair_and_stop_names import slider_names
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.construction.start_values_and_scales import GIVEN, Numbers
from trunnion.system.structure.bodies_and_joints import Joint, state_coordinates

FIRST, GROWS, LONGEST, FAR = 1e-4, 2.0, 0.1, 2.0 * math.pi
"""Steps of the search for the end of a band, in rad or relative to the scene's length. FIRST: first step; GROWS: growth factor of
the steps; LONGEST: longest step; FAR: largest distance. The steps are so short that the largest share of friction has at most one
maximum within three consecutive points."""
TIPS = 1e-12
"""Replaces ``STILL`` for mechanisms with contacts that begin and end. The value is smaller, because the acceleration grows from 0
where a contact opens."""
EXACT, MOST_STEPS = 1e-14, 200
"""EXACT: distance to which the ends of bands are located, rad or relative to the scene's length. MOST_STEPS: largest number of
steps."""


@dataclass(frozen=True)
class Band:
    """The range of a coordinate in which friction holds the mechanism. The other coordinates keep their values of the equilibrium,
    except where loops must be closed.

    Attributes:
        coordinate: name of the coordinate.
        low: lower end, rad or m; None if no end was found. For a ball joint: rotation from the equilibrium about an axis of the
            joint's inboard frame.
        high: upper end, as for ``low``.
        first: the joint that slips first, at each of the two ends.
    """

    coordinate: str
    low: float | None
    high: float | None
    first: tuple[str, str]


class BandSearch:
    """Finds the bands: the ranges of coordinates in which friction holds the mechanism. scene: the scene with friction. latches: a
    scene whose latches have the positions of the pose. still: the mechanism in the pose."""

    def __init__(self, scene: sm.Scene, latches: sm.Scene, still: MechanismAtRest):
        held = copy_latches(hold_drives(scene)[0], latches)
        self.model, self.at = Model(held, ("energy.kinetic",)), still.pose()
        self.built, self.moves = self.model.built, ""
        contacts = [j.name for j in self.model.system.unilateral]
        self.models = [self.model, *([Model(open_contacts(held, contacts), ("energy.kinetic",))] if contacts else [])]

    def holds(self) -> bool:
        """Whether friction holds the pose."""
        j = next((x for x in self.model.system.tree if x.free), None)
        return j is not None and self._excess(j, j.free[0], 0.0) <= 0.0

    def all_bands(self, chosen: Sequence[Joint], at: np.ndarray | None = None) -> tuple[Band, ...]:
        """The bands of all chosen joints. at: another pose with the same latches (nq)."""
        self.at = self.at if at is None else at
        return tuple(band for j in chosen for band in self.bands(j))

    def bands(self, joint: Joint) -> list[Band]:
        """The bands of all free coordinates of a joint."""
        j = next(x for x in self.model.system.tree if x.name == joint.name)
        return [self._band(j, k) for k in range(j.kind.nv) if k in j.free]

    def _band(self, j: Joint, k: int) -> Band:
        turns = j.kind.turns(k)
        unit, at = 1.0 if turns else self.built.numbers.length, 0.0
        ball = j.kind.coordinate_of(k) < 0
        if not ball:
            at = float(self.at[j.q0 + state_coordinates(j).index(j.kind.coordinate_of(k))])
        ends, first = [], []
        for side in (-1, 1):
            end, joint = self._end(j, k, side, unit)
            ends.append(None if end is None else at + end)
            first.append(joint)
        name = f"{j.name} about e{k - (j.kind.nv - 3) + 1}" if ball else f"{j.name}.q[{j.kind.coordinate_of(k) + 1}]"
        return Band(name, ends[0], ends[1], (first[0], first[1]))

    def _end(self, j: Joint, k: int, side: int, unit: float) -> tuple[float | None, str]:
        def excess(way: float) -> float:
            return self._excess(j, k, side * way)

        points = [(0.0, excess(0.0))]
        if points[0][1] > 0.0:
            return 0.0, self.moves
        step = FIRST * unit
        while points[-1][0] < FAR * unit:
            points = [*points[-2:], (points[-1][0] + step, excess(points[-1][0] + step))]
            inside, beyond = points[-2], points[-1]
            if beyond[1] <= 0.0 and len(points) == 3 and points[1][1] > max(points[0][1], beyond[1]):
                inside, beyond = points[0], _find_top(excess, points[0][0], beyond[0], EXACT**0.5 * unit)
            if beyond[1] > 0.0:
                return side * _find_root(excess, inside, beyond, EXACT * unit), self.moves
            step = min(GROWS * step, LONGEST * unit)
        return None, ""

    def _excess(self, j: Joint, k: int, way: float) -> float:
        """Largest share (friction over capacity) of all pairs, minus 1, after freedom k has moved by ``way``, rad or m. A pose that
        is impossible, or in which a freedom without friction accelerates, gives 1. Contacts that only push keep their state of the
        start; if this is impossible, these contacts are open."""
        q, numbers = self.at.copy(), self.built.numbers
        at = state_coordinates(j)
        if j.kind.coordinate_of(k) >= 0:
            q[j.q0 + at.index(j.kind.coordinate_of(k))] += way
        else:
            own = j.q0 + at.index(j.kind.quaternion)
            q[own : own + 4] = _rotate(q[own : own + 4], k - (j.kind.nv - 3), way)
        by_rate = np.zeros_like(numbers.q_given_by_rate)
        exact = [j.free.index(k)] if j.kind.coordinate_of(k) >= 0 else range(len(j.free))
        by_rate[[j.v0 + i for i in exact]] = GIVEN["exact"]
        moved = replace(numbers, q=q, q_given_by_rate=by_rate, v=0.0 * numbers.v)
        excesses = (self._excess_of(model, moved) for model in self.models)
        return next((x for x in excesses if x is not None), 1.0)

    def _excess_of(self, model: Model, moved: Numbers) -> float | None:
        """The result of ``_excess`` for the start values ``moved``; None if the mechanism cannot have these start values."""
        block = model.block
        block.take(moved, np.array(self.built.parameters.values))
        block.configure(Settings(rtol=1e-9))
        if block.assemble() != 1:
            return None
        block.y[model.system.nq : block.ny] = 0.0
        status = model.begin(Settings(rtol=1e-9), 0.0, 1.0, 1.0, np.zeros(block.width))
        if status == Status.FAIL_PENETRATION:
            return None
        table = model.block.hold()
        if table is None:
            return 1.0
        shares = np.nan_to_num(table["share"], nan=0.0)
        if loose := accelerating_joints(model, TIPS if model.system.unilateral else STILL):
            self.moves = loose[0]
            return 1.0
        if len(shares):
            self.moves = slider_names(model.system)[int(np.argmax(shares))][0]
        return float(shares.max(initial=0.0) - 1.0)


def _find_top(f: Callable[[float], float], a: float, b: float, near: float) -> tuple[float, float]:
    """(x, f(x)) between a and b: a point with f > 0, or else the maximum of f. Golden sections locate the maximum to ``near``."""
    part = 0.5 * (math.sqrt(5.0) - 1.0)
    x, y = b - part * (b - a), a + part * (b - a)
    fx, fy = f(x), f(y)
    while max(fx, fy) <= 0.0 and b - a > near:
        if fx > fy:
            b, y, fy = y, x, fx
            x = b - part * (b - a)
            fx = f(x)
        else:
            a, x, fx = x, y, fy
            y = a + part * (b - a)
            fy = f(y)
    return max((x, fx), (y, fy), key=lambda found: found[1])


def _find_root(f: Callable[[float], float], inside: tuple[float, float], beyond: tuple[float, float], near: float) -> float:
    """The root of f, to within ``near``, between two points (x, f(x)) of opposite signs."""
    (a, fa), (b, fb) = met = [inside, beyond]
    search = bracketed_root(fa, fb, 0.0, near / (b - a), MOST_STEPS)
    with suppress(StopIteration):
        share = next(search)
        while True:
            x = a + share * (b - a)
            met.append((x, f(x)))
            share = search.send(met[-1][1])
    return min((p for p in met if abs(p[0] - met[-1][0]) <= near), key=lambda p: abs(p[1]))[0]


def _rotate(quaternion: np.ndarray, axis: int, angle: float) -> np.ndarray:
    """The orientation ``quaternion`` (4), followed by a rotation by ``angle``, rad, about an axis (0 to 2) of the inboard
    frame."""
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    turn = np.zeros(3)
    turn[axis] = s
    w, v = quaternion[0], quaternion[1:]
    return np.concatenate([[c * w - turn @ v], c * v + w * turn + np.cross(turn, v)])


def copy_latches(scene: sm.Scene, still: sm.Scene) -> sm.Scene:
    """The scene with its latches replaced by those of the scene ``still``."""
    return replace(scene, joints={n: replace(j, latch=still.joints[n].latch) for n, j in scene.joints.items()})
