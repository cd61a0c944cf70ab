"""``equilibrium``: where a mechanism comes to rest, and with friction the band of positions in which it stays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError, SimulationError
from engine.joints import REGISTRY
from engine.questions.still import Still, ideal
from engine.scene import model as sm
from engine.scene.overrides import Given, scene_given
from engine.simulation.block import Settings
from engine.simulation.hold import resting
from engine.simulation.pairs import slider_names
from engine.simulation.result import Result
from engine.simulation.run import Model, simulate
from engine.system.structure import Joint, state_coordinates

SWINGS = 60
"""Times a swing is stopped where it is fastest: each keeps about a tenth of the energy of the one before."""
SETTLED = 1e-4
"""Of the scale of kinetic energy: below it Newton's method takes over."""
FIRST, GROWS, FAR = 1e-4, 2.0, 2.0 * math.pi
"""First step outward when looking for the end of a band (rad, or of the scene's length), its growth, how far it is looked for."""
EXACT = 1e-14
NEUTRAL = 1e-9
"""Of the largest stiffness: below it a direction has none (round-off leaves 1e-13)."""


@dataclass(frozen=True)
class Band:
    """How far a coordinate may be from equilibrium, the others as there (loops following), so that everything still holds. low
    and high: rad or m, of the coordinate itself, of a ball the angle about an axis of its inboard frame from the equilibrium;
    None where no end was found; first: the joints that let go there."""

    coordinate: str
    low: float | None
    high: float | None
    first: tuple[str, str]


@dataclass(frozen=True)
class Equilibrium:
    """A pose of rest of the mechanism without friction. q: coordinates of tree joints by name; kind: "stable" (it swings back),
    "neutral" (it also rests beside it) or "unstable"; bands: with friction, one for each coordinate asked for."""

    q: dict[str, tuple[float, ...]]
    kind: str
    bands: tuple[Band, ...]

    def document(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def equilibrium(scene: Given, along: str | Sequence[str] | None = None, overrides: Mapping[str, Any] | None = None) -> Equilibrium:
    """The pose of rest that the mechanism comes to from its start, friction left out, drives held and loads as at t = 0; along:
    joints of whose freedoms the bands of rest with friction are wanted (default: those that rub in the tree, all where none of
    them does; () for none).
    SceneError for wrong input, SimulationError when it has no rest (it falls, or its loops cannot be closed)."""
    loaded = scene_given(scene, overrides)
    wanted = (along,) if isinstance(along, str) else along
    if wrong := [n for n in wanted or () if n not in loaded.joints]:
        raise SceneError([Problem("along", f"there is no joint {n!r}", f"joints: {', '.join(loaded.joints)}") for n in wrong])
    still = settled(ideal(loaded))
    q = coordinates(still)
    bands, moving = [], [j.name for j in still.system.tree]
    if cut := [n for n in wanted or () if n not in moving]:
        what, hint = "closes a loop or couples others: it has no coordinate of its own", f"ask for the band of: {', '.join(moving)}"
        raise SceneError([Problem(f"along {n}", what, hint) for n in cut])
    rubbing = [j for j in still.system.tree if loaded.joints[j.name].friction is not None]
    rubbing = rubbing or [j for j in still.system.tree if any(k in j.free for k in range(j.kind.nv))]  # a cut joint's, teeth
    chosen = rubbing if wanted is None else [j for j in still.system.tree if j.name in wanted]
    if chosen and any(j.friction is not None for j in loaded.joints.values()):
        hold = _Holding(loaded, still)
        bands = [band for j in chosen for band in hold.bands(j)]
    return Equilibrium(q, _kind(still), tuple(bands))


def _kind(still: Still) -> str:
    stiffness, _, _ = still.reduced()
    if not stiffness.size:
        return "stable"
    most = float(np.linalg.eigvals(stiffness).real.max())
    scale = max(still.model.built.numbers.rate**2, float(np.abs(stiffness).max()))
    return "unstable" if most > NEUTRAL * scale else "neutral" if most > -NEUTRAL * scale else "stable"


def coordinates(still: Still) -> dict[str, tuple[float, ...]]:
    """Coordinates of tree joints that are states, by name."""
    y = still.block.y
    return {j.name: tuple(map(float, y[j.q0 : j.q0 + len(state_coordinates(j))])) for j in still.system.tree if j.kind.nv}


def settled(scene: sm.Scene) -> Still:
    """The scene at rest where it comes to rest: swings are stopped where they are fastest, and Newton's method makes it exact."""
    still = Still(scene)
    numbers = still.model.built.numbers
    if np.abs(still.accelerations()).max(initial=0.0) > EXACT * numbers.rate**2:
        watched = ("energy.kinetic", "*.q[*]", *(["*.latch.state[*]"] if any(j.latch for j in scene.joints.values()) else []))
        ended = any(x is not None for j in scene.joints.values() for x in (j.stops, j.latch))  # pressed for less than a row lasts
        for _ in range(SWINGS):
            spell = 1.0 / numbers.rate
            r = simulate(scene, until=8.0 * spell, every=0.0 if ended else 0.02 * spell, rtol=1e-8, outputs=watched)
            if not r.outcome.ok:
                raise SimulationError(f"it does not come to rest: {r.outcome}")
            kinetic = r["energy.kinetic"]
            row = _fastest(kinetic)
            if row is None:
                raise SimulationError("it has no rest: it moves away faster and faster (is something missing that carries it?)")
            q, down = (_at(r, row, of, scene.joints) for of in ("q", "latch.state"))
            scene = hooked(started(scene, q), down)
            if kinetic[row] < SETTLED * numbers.energy:
                break
        still = Still(scene)
    if not still.settle():
        raise SimulationError("no pose of rest was found near the one it came to")
    return still


def _at(r: Result, row: int, of: str, joints: Iterable[str]) -> dict[str, np.ndarray]:
    """Columns of joints in a row, by the name of the joint."""
    return {n: np.array([r[c][row] for c in r.matching(f"{n}.{of}[*]")]) for n in joints}


def _fastest(kinetic: np.ndarray) -> int | None:
    """The row in which it is fastest before it slows down; None where it never does."""
    slower = np.flatnonzero(np.diff(kinetic) < 0.0)
    return int(slower[0]) if len(slower) else None


def started(scene: sm.Scene, q: Mapping[str, np.ndarray]) -> sm.Scene:
    """The scene with these start coordinates, at rest."""
    joints = {}
    for name, j in scene.joints.items():
        values = () if REGISTRY[j.type].bodiless else tuple(map(float, q.get(name, ())))
        start = sm.Start(q=values if len(values) != 1 else values[0]) if values and j.drive is None else j.start
        joints[name] = replace(j, start=start if start is None else replace(start, qd=None))
    return replace(scene, joints=joints)


def hooked(scene: sm.Scene, down: Mapping[str, np.ndarray]) -> sm.Scene:
    """The scene with the hooks of latches that are down from its start on, each on its tooth. down: for each latch of a joint
    which one (from 1; 0: up), by its name."""
    joints = {}
    for name, j in scene.joints.items():
        states, latches = iter(down.get(name, ())), j.latch if isinstance(j.latch, tuple) else (j.latch,)
        put = tuple(None if x is None else _down(x, round(next(states, 0.0))) for x in latches)
        joints[name] = replace(j, latch=put if isinstance(j.latch, tuple) else put[0])
    return replace(scene, joints=joints)


def _down(x: sm.Latch, tooth: int) -> sm.Latch:
    """A latch that is down from the start on a tooth (from 1; 0: up), which then is its first."""
    further = (x.pitch or 0.0) * max(tooth - 1, 0)
    return replace(x, at=x.at + (further if x.keeps == "above" else -further), down=tooth > 0)


def caught(scene: sm.Scene, still: sm.Scene) -> sm.Scene:
    """The scene with its hooks on the teeth on which those of ``still`` are."""
    return replace(scene, joints={n: replace(j, latch=still.joints[n].latch) for n, j in scene.joints.items()})


class _Holding:
    """What holds with friction near an equilibrium, pose by pose."""

    def __init__(self, scene: sm.Scene, still: Still):
        held = caught(resting(scene)[0], still.scene)
        self.model, self.at = Model(held, ("energy.kinetic",)), still.block.y[: still.system.nq].copy()
        self.built, self.moves = self.model.built, ""

    def bands(self, joint: Joint) -> list[Band]:
        """The bands of a joint's freedoms."""
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
        inside, step = 0.0, FIRST * unit
        if self._beyond(j, k, 0.0) > 0.0:
            return 0.0, self.moves
        while step <= FAR * unit:
            if self._beyond(j, k, side * step) > 0.0:
                found = _crossing(lambda x: self._beyond(j, k, side * x), inside, step, EXACT * unit)
                return side * found, self.moves
            inside, step = step, GROWS * step
        return None, ""

    def _beyond(self, j: Joint, k: int, way: float) -> float:
        """By how much the worst pair is asked for more than it can give, its capacity being 1; 1 where the pose cannot be."""
        q, numbers = self.at.copy(), self.built.numbers
        at = state_coordinates(j)
        if j.kind.coordinate_of(k) >= 0:
            q[j.q0 + at.index(j.kind.coordinate_of(k))] += way
        else:
            own = j.q0 + at.index(j.kind.quaternion)
            q[own : own + 4] = _turned(q[own : own + 4], k - (j.kind.nv - 3), way)
        given, by_rate = np.zeros_like(numbers.q_given), np.zeros_like(numbers.q_given_by_rate)
        given[j.q0 : j.q0 + len(at)] = 1.0
        by_rate[j.v0 : j.v0 + len(j.free)] = 1.0
        block = self.model.block
        moved = replace(numbers, q=q, q_given=given, q_given_by_rate=by_rate, v=0.0 * numbers.v)
        block.take(moved, np.array(self.built.parameters.values))
        block.configure(Settings(rtol=1e-9))
        if block.assemble() != 1:
            return 1.0
        block.y[self.model.system.nq : block.ny] = 0.0
        self.model.begin(Settings(rtol=1e-9), 0.0, 1.0, 1.0, np.zeros(block.width))
        table = self.model.block.hold()
        if table is None:
            return 1.0
        shares = np.nan_to_num(table["share"], nan=0.0)
        if len(shares):
            self.moves = slider_names(self.model.system)[int(np.argmax(shares))][0]
        return float(shares.max(initial=0.0) - 1.0)


def _crossing(f: Callable[[float], float], a: float, b: float, near: float) -> float:
    """The root of f between a and b, where f has opposite signs, to within ``near``: by secants that keep it between (Illinois),
    and halving where they are slow. (SciPy's is not part of the plain installation.)"""
    fa, fb = f(a), f(b)
    for n in range(200):
        x = 0.5 * (a + b) if n % 3 == 2 or fb == fa else b - fb * (b - a) / (fb - fa)
        fx = f(x)
        if fx * fb <= 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = x, fx
        if fb == 0.0 or abs(b - a) <= near:
            break
    return b


def _turned(quaternion: np.ndarray, axis: int, angle: float) -> np.ndarray:
    """A rotation with one about an axis of the inboard frame behind it."""
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    turn = np.zeros(3)
    turn[axis] = s
    w, v = quaternion[0], quaternion[1:]
    return np.concatenate([[c * w - turn @ v], c * v + w * turn + np.cross(turn, v)])
