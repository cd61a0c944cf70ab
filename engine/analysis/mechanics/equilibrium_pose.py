"""``equilibrium``: the pose in which a mechanism comes to rest, and with friction the range of positions in which it stays at
rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, is_dataclass, replace
from typing import Any

import numpy as np

from trunnion.analysis.mechanics.friction_rest_ranges import Band, BandSearch
from trunnion.analysis.mechanics.further_equilibrium_poses import kind_of, other_rests
from trunnion.analysis.mechanics.mechanism_at_rest import MechanismAtRest, open_contacts, remove_friction
from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.signals.registry import value_at
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate
from trunnion.system.structure.bodies_and_joints import Joint, System, state_coordinates

DOUBLINGS = 11
"""Largest number of damped runs. Each run is twice as long as the run before."""
SHORTEST_RUN = 8.0
"""Duration of the first damped run, relative to the time scale of the mechanism."""
SETTLED = 1e-3
"""When all accelerations, relative to their scale, are below this value, the damped runs end and Newton's method finds the exact
pose."""
STILL = 1e-14
"""A start counts as at rest if its accelerations, relative to their scale, are below this value."""
TURN = 2.0 * math.pi
REPEATED = 1e-8
"""Two poses are one turn apart if loops and accelerations, relative to their scale, differ by less than this value."""


@dataclass(frozen=True)
class Rest:
    """A further pose of rest of the mechanism without friction.

    Attributes:
        q: coordinates of tree joints by name, rad or m.
        kind: "stable" or "unstable".
        bands: as for ``Equilibrium``, about this pose.
    """

    q: dict[str, tuple[float, ...]]
    kind: str
    bands: tuple[Band, ...]


@dataclass(frozen=True)
class Equilibrium:
    """A pose of rest of the mechanism without friction, and ranges in which friction holds it.

    Attributes:
        q: coordinates of tree joints by name, rad or m.
        kind: "stable", "neutral" (neighbouring poses are also poses of rest) or "unstable"; "none" if there is no pose of rest
            without friction. Then ``q`` is the given pose, at which friction holds the mechanism.
        bands: ranges in which friction holds the mechanism at rest, one for each chosen coordinate.
        around: ranges that contain the given pose; the other coordinates keep their given values. Empty if friction does not hold
            the given pose.
        others: further isolated poses of rest without friction, at most 8, found by Newton's method from poses with one coordinate
            moved. Empty for mechanisms with ball joints or with contacts that begin and end, for which there is no search.
    """

    q: dict[str, tuple[float, ...]]
    kind: str
    bands: tuple[Band, ...]
    around: tuple[Band, ...] = ()
    others: tuple[Rest, ...] = ()

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers."""
        return asdict(self)


def equilibrium(scene: Given, along: str | Sequence[str] | None = None, overrides: Mapping[str, Any] | None = None) -> Equilibrium:
    """The pose in which the mechanism without friction comes to rest from its start, and where friction holds the mechanism.
    Drives are held; loads are those of t = 0.
    A contact that can begin and end is either pressed or open.

    Args:
        scene: as for ``simulate``.
        along: joints whose ranges of rest are computed; () means no joint. Default: the tree joints with friction, or all tree
            joints if no tree joint has friction.
        overrides: changes of the scene, {path: value}.

    Raises:
        SceneError: for wrong input.
        SimulationError: if the mechanism does not come to rest (it falls) and friction does not hold its given pose; if its loops
            cannot be closed.
    """
    loaded = scene_given(scene, overrides)
    wanted = (along,) if isinstance(along, str) else along
    if wrong := [n for n in wanted or () if n not in loaded.joints]:
        raise SceneError([Problem("along", f"there is no joint {n!r}", f"joints: {', '.join(loaded.joints)}") for n in wrong])
    bare = remove_friction(loaded)
    start = MechanismAtRest(bare)
    chosen = _chosen_joints(loaded, start.system, wanted)
    q, given = coordinates(start.system, start.pose()), BandSearch(loaded, bare, start) if chosen else None
    around = given.all_bands(chosen) if given and given.holds() else ()
    try:
        still = find_rest(bare)
    except SimulationError:
        if not around:
            raise
        return Equilibrium(q, "none", (), around)
    loaded = open_contacts(loaded, still.open_contacts())
    search = BandSearch(loaded, still.scene, still) if chosen else None
    bands = search.all_bands(chosen) if search else ()
    others = []
    for y, kind in other_rests(still):
        others.append(Rest(coordinates(still.system, y), kind, search.all_bands(chosen, y) if search else ()))
    return Equilibrium(coordinates(still.system, still.pose()), kind_of(still)[0], bands, around, tuple(others))


def _chosen_joints(scene: sm.Scene, system: System, wanted: Sequence[str] | None) -> list[Joint]:
    """The tree joints whose ranges of rest are computed; none in a scene without friction."""
    if cut := [n for n in wanted or () if n not in [j.name for j in system.tree]]:
        what = "closes a loop or couples joints, so it has no coordinate of its own"
        hint = f"choose among: {', '.join(j.name for j in system.tree)}"
        raise SceneError([Problem(f"along {n}", what, hint) for n in cut])
    if all(j.friction is None for j in scene.joints.values()):
        return []
    if wanted is not None:
        return [j for j in system.tree if j.name in wanted]
    rubbing = [j for j in system.tree if scene.joints[j.name].friction is not None]
    return rubbing or [j for j in system.tree if any(k in j.free for k in range(j.kind.nv))]


def coordinates(system: System, y: np.ndarray) -> dict[str, tuple[float, ...]]:
    """Coordinates that are states, {tree joint: values in rad or m}. y: the state's coordinates (nq)."""
    return {j.name: tuple(map(float, y[j.q0 : j.q0 + len(state_coordinates(j))])) for j in system.tree if j.kind.nv}


def find_rest(scene: sm.Scene) -> MechanismAtRest:
    """The scene in its pose of rest. Dampers bring the mechanism to rest from its start, with the loads of t = 0. Newton's method
    then finds the exact pose.

    Raises SimulationError if no pose of rest is found.
    """
    still = MechanismAtRest(scene)
    slow, fast = still.model.built.numbers.rate, _fastest_rate(still)
    if _size(still, slow) <= STILL and still.settle():
        return still
    watched = ["*.q[*]", *(["*.latch.state[*]"] if any(j.latch for j in scene.joints.values()) else [])]
    watched += [f"{j.name}.gap" for j in still.system.unilateral]
    damping = _damping(still, fast)
    for k in range(DOUBLINGS):
        duration = SHORTEST_RUN * 2**k / slow
        r = simulate(_damped(hold_signals(scene), damping), until=duration, every=duration, rtol=1e-8, outputs=watched)
        if not r.outcome.ok:
            raise SimulationError(f"the mechanism does not come to rest: {r.outcome}")
        q, down = ({n: [r[c][-1] for c in r.matching(f"{n}.{of}[*]")] for n in scene.joints} for of in ("q", "latch.state"))
        gaps = {j.name: float(r[f"{j.name}.gap"][-1]) for j in still.system.unilateral}
        scene = engage_latches(open_contacts(start_at(scene, q), [n for n, gap in gaps.items() if gap]), down)
        begun, still = still.pose(), MechanismAtRest(scene)
        if _size(still, fast) < SETTLED and still.settle():
            return still
        if k > 0 and _turns_for_ever(begun, still, r):
            raise SimulationError("no pose of rest: the mechanism turns on and on, even with dampers (is a support missing?)")
    raise SimulationError("no pose of rest: the mechanism never stops, even with dampers (is a support missing?)")


def _turns_for_ever(begun: np.ndarray, still: MechanismAtRest, run: Result) -> bool:
    """Whether the run shows that the mechanism never comes to rest (theory, "Rest, swings and efforts"). The run led from rest in
    the pose ``begun`` (nq) to the pose of ``still``."""
    system, joints, y = still.system, still.scene.joints, still.block.y
    angles, turns = {c.name for c in run.columns if c.unit == "rad"}, np.zeros(system.nq)
    for j in system.tree:
        for k, q in enumerate(state_coordinates(j), j.q0):
            away = float(y[k] - begun[k])
            turns[k] = math.copysign(TURN, away) if f"{j.name}.q[{q + 1}]" in angles and abs(away) > TURN else 0.0
    wound = [j for n, j in joints.items() if any(abs(run[c][-1] - run[c][0]) > TURN for c in run.matching(f"{n}.q[*]"))]
    held = any(j.spring or j.nonlinear or j.end_stops for j in wound) or any(j.latch for j in joints.values())
    if not turns.any() or held or system.unilateral or still.allowed().shape[1] != 1:
        return False
    here = still.accelerations()
    y[: system.nq] -= turns
    apart = np.concatenate([still.block.gap()[0], (still.accelerations() - here) / still.model.built.numbers.rate**2])
    y[: system.nq] += turns
    return bool(np.abs(apart).max() < REPEATED)


def _size(still: MechanismAtRest, rate: float) -> float:
    """Largest acceleration at rest, relative to the scale ``rate``² (rate in 1/s)."""
    return float(np.abs(still.accelerations()).max(initial=0.0)) / max(rate**2, 1e-300)


def _fastest_rate(still: MechanismAtRest) -> float:
    """The larger of two rates, 1/s: the rate scale of the mechanism, and the rate of its fastest swing about the start."""
    stiffness = still.reduced()[0]
    swings = np.abs(np.linalg.eigvals(stiffness)) if stiffness.size else np.zeros(1)
    return max(still.model.built.numbers.rate, math.sqrt(float(swings.max())))


def _damping(still: MechanismAtRest, rate: float) -> dict[str, np.ndarray]:
    """For each tree joint, the dampings of its freedoms, {joint: values in N s/m or N m s/rad}. These dampings stop the fastest
    swing within one period. With less damping, loads that rotate with their body could sustain the motion."""
    along = np.diag(still.mass()) * rate
    out = {}
    for j in still.system.tree:
        out[j.name] = np.zeros(j.kind.nv)
        out[j.name][list(j.free)] = along[j.v0 : j.v0 + len(j.free)]
    return out


def _damped(scene: sm.Scene, damping: Mapping[str, np.ndarray]) -> sm.Scene:
    """The scene with additional damping in its joints, and with impacts without restitution."""
    plastic = {n: replace(j.unilateral, restitution=0.0) if j.unilateral else None for n, j in scene.joints.items()}
    joints = {n: replace(j, unilateral=plastic[n]) for n, j in scene.joints.items()}
    for name, more in damping.items():
        own = joints[name].damping
        each = own if isinstance(own, tuple) else (own,) * len(more)
        total = tuple(float(c + (x or 0.0)) for c, x in zip(more, each, strict=True))
        if total:
            joints[name] = replace(joints[name], damping=total if len(total) > 1 else total[0])
    return replace(scene, joints=joints)


def hold_signals(scene: sm.Scene) -> sm.Scene:
    """The scene with every load constant at its value of t = 0."""
    joints = {n: replace(j, **_held_fields(j)) for n, j in scene.joints.items()}
    return replace(scene, joints=joints, forces={n: replace(f, **_held_fields(f)) for n, f in scene.forces.items()})


def _held_fields(owner: Any) -> dict[str, Any]:
    """The fields of a data class that contain signals, with each signal replaced by its value at t = 0."""
    values = {f.name: getattr(owner, f.name) for f in fields(owner) if f.init}
    return {n: held for n, v in values.items() if (held := _held(v)) is not v}


def _held(value: Any) -> Any:
    """``value`` with each signal in it replaced by the signal's value at t = 0. Returns ``value`` itself if it contains no
    signal."""
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
