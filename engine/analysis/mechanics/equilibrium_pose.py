"""``equilibrium``: the pose in which a mechanism comes to rest, and with friction the range of positions in which it stays at
rest."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np

from trunnion.analysis.mechanics.mechanism_at_rest import Still, remove_friction
from trunnion.analysis.static_bounds.static_margin import hold_drives
from trunnion.basics.problems import Problem, SceneError, SimulationError
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.queries.unilateral_joints import refuse_unilateral
from trunnion.scene.signals.registry import value_at
from trunnion.simulation.run import Model, simulate
from trunnion.simulation.runtime_interface.friction_pair_names import slider_names
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.structure.bodies_and_joints import Joint, state_coordinates

DOUBLINGS = 11
"""Largest number of damped runs. Each run is twice as long as the run before."""
SHORTEST_RUN = 8.0
"""Duration of the first damped run, relative to the time scale of the mechanism."""
SETTLED = 1e-3
"""When all accelerations, relative to their scale, are below this value, the damped runs end and Newton's method finds the exact
pose."""
FIRST, GROWS, LONGEST, FAR = 1e-4, 2.0, 0.1, 2.0 * math.pi
"""Search for the end of a band, in rad or relative to the scene's length. FIRST: first step; GROWS: growth factor of the steps;
LONGEST: longest step; FAR: largest distance. The steps are so short that the largest share of friction has at most one maximum
within three consecutive points."""
EXACT = 1e-14
NEUTRAL = 1e-9
"""A direction counts as without stiffness if its stiffness, relative to the largest stiffness, is below this value (round-off is
1e-13)."""


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


@dataclass(frozen=True)
class Equilibrium:
    """A pose of rest of the mechanism without friction.

    Attributes:
        q: coordinates of tree joints by name, rad or m.
        kind: "stable", "neutral" (neighbouring poses are also poses of rest) or "unstable".
        bands: ranges in which friction holds the mechanism at rest, one for each chosen coordinate.
    """

    q: dict[str, tuple[float, ...]]
    kind: str
    bands: tuple[Band, ...]

    def document(self) -> dict[str, Any]:
        """The same data as plain lists and numbers."""
        return asdict(self)


def equilibrium(scene: Given, along: str | Sequence[str] | None = None, overrides: Mapping[str, Any] | None = None) -> Equilibrium:
    """The pose in which the mechanism without friction comes to rest from its start. Drives are held; loads are those of t = 0.

    Args:
        scene: as for ``simulate``.
        along: joints whose ``bands`` are computed; () means no joint. Default: the tree joints with friction, or all tree joints
            if no tree joint has friction.
        overrides: changes of the scene, {path: value}.

    Raises:
        SceneError: for wrong input.
        SimulationError: if the mechanism does not come to rest (it falls), or if its loops cannot be closed.
    """
    loaded = scene_given(scene, overrides)
    refuse_unilateral(loaded, "the search of a pose of rest")
    wanted = (along,) if isinstance(along, str) else along
    if wrong := [n for n in wanted or () if n not in loaded.joints]:
        raise SceneError([Problem("along", f"there is no joint {n!r}", f"joints: {', '.join(loaded.joints)}") for n in wrong])
    still = find_rest(remove_friction(loaded))
    q = coordinates(still)
    bands, moving = [], [j.name for j in still.system.tree]
    if cut := [n for n in wanted or () if n not in moving]:
        what, hint = "closes a loop or couples joints, so it has no coordinate of its own", f"choose among: {', '.join(moving)}"
        raise SceneError([Problem(f"along {n}", what, hint) for n in cut])
    rubbing = [j for j in still.system.tree if loaded.joints[j.name].friction is not None]
    rubbing = rubbing or [j for j in still.system.tree if any(k in j.free for k in range(j.kind.nv))]
    chosen = rubbing if wanted is None else [j for j in still.system.tree if j.name in wanted]
    if chosen and any(j.friction is not None for j in loaded.joints.values()):
        search = _BandSearch(loaded, still)
        bands = [band for j in chosen for band in search.bands(j)]
    return Equilibrium(q, _kind(still), tuple(bands))


def _kind(still: Still) -> str:
    stiffness, _, _ = still.reduced()
    if not stiffness.size:
        return "stable"
    most = float(np.linalg.eigvals(stiffness).real.max())
    scale = max(still.model.built.numbers.rate**2, float(np.abs(stiffness).max()))
    return "unstable" if most > NEUTRAL * scale else "neutral" if most > -NEUTRAL * scale else "stable"


def coordinates(still: Still) -> dict[str, tuple[float, ...]]:
    """Coordinates that are states, {tree joint: values in rad or m}."""
    y = still.block.y
    return {j.name: tuple(map(float, y[j.q0 : j.q0 + len(state_coordinates(j))])) for j in still.system.tree if j.kind.nv}


def find_rest(scene: sm.Scene) -> Still:
    """The scene in its pose of rest: dampers bring it to rest from its start, with the loads of t = 0. Newton's method then finds
    the exact pose.

    SimulationError if no pose of rest is found.
    """
    still = Still(scene)
    slow, fast = still.model.built.numbers.rate, _fastest_rate(still)
    if _size(still, slow) <= EXACT and still.settle():
        return still
    watched = ("*.q[*]", *(["*.latch.state[*]"] if any(j.latch for j in scene.joints.values()) else []))
    damping = _damping(still, fast)
    for k in range(DOUBLINGS):
        duration = SHORTEST_RUN * 2**k / slow
        r = simulate(_damped(hold_signals(scene), damping), until=duration, every=duration, rtol=1e-8, outputs=watched)
        if not r.outcome.ok:
            raise SimulationError(f"the mechanism does not come to rest: {r.outcome}")
        q, down = ({n: [r[c][-1] for c in r.matching(f"{n}.{of}[*]")] for n in scene.joints} for of in ("q", "latch.state"))
        scene = engage_latches(start_at(scene, q), down)
        still = Still(scene)
        if _size(still, fast) < SETTLED and still.settle():
            return still
    raise SimulationError("no pose of rest: the mechanism moves on without end, even with dampers (is a support missing?)")


def _size(still: Still, rate: float) -> float:
    """Largest acceleration at rest, relative to its scale ``rate``² (rate in 1/s)."""
    return float(np.abs(still.accelerations()).max(initial=0.0)) / max(rate**2, 1e-300)


def _fastest_rate(still: Still) -> float:
    """The rate scale of the mechanism or, if higher, the rate of its fastest swing about the start, 1/s."""
    stiffness = still.reduced()[0]
    swings = np.abs(np.linalg.eigvals(stiffness)) if stiffness.size else np.zeros(1)
    return max(still.model.built.numbers.rate, math.sqrt(float(swings.max())))


def _damping(still: Still, rate: float) -> dict[str, np.ndarray]:
    """For each tree joint, the dampings of its freedoms, {joint: values in N s/m or N m s/rad}. These dampings stop the fastest
    swing within one period. With less damping, loads that rotate with their body could sustain the motion."""
    along = np.diag(still.mass()) * rate
    out = {}
    for j in still.system.tree:
        out[j.name] = np.zeros(j.kind.nv)
        out[j.name][list(j.free)] = along[j.v0 : j.v0 + len(j.free)]
    return out


def _damped(scene: sm.Scene, damping: Mapping[str, np.ndarray]) -> sm.Scene:
    """The scene with further dampings of its joints."""
    joints = dict(scene.joints)
    for name, more in damping.items():
        own = joints[name].damping
        each = own if isinstance(own, tuple) else (own,) * len(more)
        total = tuple(float(c + (x or 0.0)) for c, x in zip(more, each, strict=True))
        if total:
            joints[name] = replace(joints[name], damping=total if len(total) > 1 else total[0])
    return replace(scene, joints=joints)


def hold_signals(scene: sm.Scene) -> sm.Scene:
    """The scene with every load at its value of t = 0."""
    joints = {n: replace(j, **_held_fields(j)) for n, j in scene.joints.items()}
    return replace(scene, joints=joints, forces={n: replace(f, **_held_fields(f)) for n, f in scene.forces.items()})


def _held_fields(owner: Any) -> dict[str, Any]:
    """Those fields of a data class that contain signals, with each signal replaced by its value at t = 0."""
    values = {f.name: getattr(owner, f.name) for f in fields(owner) if f.init}
    return {n: held for n, v in values.items() if (held := _held(v)) is not v}


def _held(value: Any) -> Any:
    """``value`` with each signal in it replaced by the signal's value at t = 0. The same object if it contains no signal."""
    if isinstance(value, sm.Signal):
        return value_at(value, 0.0)
    if isinstance(value, tuple):
        held = tuple(map(_held, value))
        return value if all(a is b for a, b in zip(held, value, strict=True)) else held
    if is_dataclass(value) and not isinstance(value, type) and (changed := _held_fields(value)):
        return replace(value, **changed)
    return value


def start_at(scene: sm.Scene, q: Mapping[str, Sequence[float]]) -> sm.Scene:
    """The scene at rest, with start coordinates q ({joint: values in rad or m})."""
    joints = {}
    for name, j in scene.joints.items():
        values = () if REGISTRY[j.type].bodiless else tuple(map(float, q.get(name, ())))
        start = sm.Start(q=values if len(values) != 1 else values[0]) if values and j.drive is None else j.start
        joints[name] = replace(j, start=start if start is None else replace(start, qd=None))
    return replace(scene, joints=joints)


def engage_latches(scene: sm.Scene, down: Mapping[str, Sequence[float]]) -> sm.Scene:
    """The scene with latches engaged at its start. down: {joint: tooth of each latch}, counted from 1; 0 means disengaged."""
    joints = {}
    for name, j in scene.joints.items():
        states, latches = iter(down.get(name, ())), j.latch if isinstance(j.latch, tuple) else (j.latch,)
        put = tuple(None if x is None else _engage(x, round(next(states, 0.0))) for x in latches)
        joints[name] = replace(j, latch=put if isinstance(j.latch, tuple) else put[0])
    return replace(scene, joints=joints)


def _engage(x: sm.Latch, tooth: int) -> sm.Latch:
    """The latch, starting on ``tooth`` (counted from 1; 0 means disengaged). This tooth becomes the first tooth of the latch."""
    further = (x.pitch or 0.0) * max(tooth - 1, 0)
    return replace(x, at=x.at + (further if x.keeps == "above" else -further), down=tooth > 0)


def copy_latches(scene: sm.Scene, still: sm.Scene) -> sm.Scene:
    """The scene with its latches replaced by those of the scene ``still``."""
    return replace(scene, joints={n: replace(j, latch=still.joints[n].latch) for n, j in scene.joints.items()})


class _BandSearch:
    """Finds the bands: the ranges of coordinates in which friction holds the mechanism. Each search starts from an equilibrium."""

    def __init__(self, scene: sm.Scene, still: Still):
        held = copy_latches(hold_drives(scene)[0], still.scene)
        self.model, self.at = Model(held, ("energy.kinetic",)), still.block.y[: still.system.nq].copy()
        self.built, self.moves = self.model.built, ""

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
                return side * _find_root(excess, inside[0], beyond[0], EXACT * unit), self.moves
            step = min(GROWS * step, LONGEST * unit)
        return None, ""

    def _excess(self, j: Joint, k: int, way: float) -> float:
        """Largest share (friction over capacity) of all pairs, minus 1, after freedom k has moved by ``way``, rad or m. An
        impossible pose gives 1."""
        q, numbers = self.at.copy(), self.built.numbers
        at = state_coordinates(j)
        if j.kind.coordinate_of(k) >= 0:
            q[j.q0 + at.index(j.kind.coordinate_of(k))] += way
        else:
            own = j.q0 + at.index(j.kind.quaternion)
            q[own : own + 4] = _rotate(q[own : own + 4], k - (j.kind.nv - 3), way)
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


def _find_root(f: Callable[[float], float], a: float, b: float, near: float) -> float:
    """The root of f between a and b, where f has opposite signs, to within ``near``. Uses the Illinois method with bisections.

    SciPy's root finders are not part of the plain installation.
    """
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


def _rotate(quaternion: np.ndarray, axis: int, angle: float) -> np.ndarray:
    """The orientation ``quaternion`` (4), followed by a rotation by ``angle``, rad, about an axis (0 to 2) of the inboard
    frame."""
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    turn = np.zeros(3)
    turn[axis] = s
    w, v = quaternion[0], quaternion[1:]
    return np.concatenate([[c * w - turn @ v], c * v + w * turn + np.cross(turn, v)])
