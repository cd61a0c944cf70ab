"""Random scenes with consistent states: trees of every joint type, and closed loops made from them.

The name of the purpose of a choice determines its stream of random numbers. A new joint type therefore changes only the joints that
get this type, not the bodies, points, devices and numbers of other joints. Scenes without the new type stay unchanged. Tests select
cases by required properties (``first``, ``covering``), not by seed. """

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import GROUND
from tests.reference.mechanics.joint_constraints import freedoms, joint_transform, of
from tests.reference.mechanics.kinematics import State, closure, forward, measured
from tests.reference.mechanics.time_signals import per_freedom
from tests.reference.scenes import random_components as rp
from tests.reference.scenes.random_streams import chosen, covering, first, stream
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm

__all__ = ["ALL_TYPES", "CLOSING_TYPES", "LATER", "USUAL_TYPES", "Case", "covering", "first", "random_loop", "random_tree"]
ALL_TYPES = tuple(k.name for k in REGISTRY.values() if not k.bodiless)
"""Every joint type that carries a body; wheels (``tests/engine/mechanisms/gear_pairs.py``) do not."""
CLOSING_TYPES = tuple(k for k in ALL_TYPES if REGISTRY[k].nv < 6)
LATER = ("point_on_line", "point_on_plane")
"""Types that random scenes do not contain, so that seeds give the same scenes as before these types existed; tests name them
explicitly."""
USUAL_TYPES = tuple(k for k in ALL_TYPES if k not in LATER)


@dataclass(frozen=True)
class Case:
    """A scene and one consistent state of it at time t: q and qd of every joint that has coordinates.

    ``tree``: the joints from which the state was made; all other joints close loops.
    """

    scene: sm.Scene
    q: dict[str, np.ndarray]
    qd: dict[str, np.ndarray]
    t: float = 0.0
    tree: tuple[str, ...] = field(default=())

    def state(self) -> State:
        """The reference's state of all bodies (walked along ``tree``)."""
        near = {n: self.q[n] for n in self.q if n in self.tree}
        state = forward(self.scene, near, self.qd, self.t)
        for name in state.loops:
            state.q[name], state.qd[name] = measured(state, name, self.q.get(name))
        return state


# -- trees -------------------------------------------------------------------------------------------------------------


def random_tree(
    seed: int | str,
    bodies: int | None = None,
    types: tuple[str, ...] = USUAL_TYPES,
    friction: float = 0.4,
    devices: float = 0.4,
    drives: float = 0.15,
    loads: bool = True,
    t: float = 0.0,
    laws: tuple[str, ...] = ("regularized", "viscous"),
    adams: float = 0.2,
) -> Case:
    """A random tree of 1 to 6 bodies; ``friction``, ``devices``, ``drives``, ``adams`` are probabilities per joint."""
    number = bodies or int(stream(seed, "bodies").integers(1, 7))
    parts, joints, q, qd = [GROUND], {}, {}, {}
    for i in range(number):
        name, child = f"j{i + 1}", f"b{i + 1}"
        kind = chosen(types, seed, name)
        place = stream(seed, name, "place")
        parent = str(place.choice(parts))
        ends = (parent, child) if place.random() < 0.5 else (child, parent)
        q[name], qd[name] = rp.coordinates(stream(seed, name, kind), kind)
        entries = rp.sides(stream(seed, name, kind, "sides"), kind, *ends) | _extras(stream(seed, name, kind, "extras"), kind)
        some = stream(seed, name, kind, "devices")
        if some.random() < devices:
            entries |= rp.devices(some, kind, q[name])
        rub = stream(seed, name, kind, "friction")
        if (kind in rp.RUBBING_TYPES or (types == (kind,) and kind in rp.APART)) and rub.random() < friction:
            entries["friction"] = rp.friction(rub, kind, laws, adams)
        drive = stream(seed, name, kind, "drive")
        if of(kind).scalars and drive.random() < drives:
            entries["drive"] = _driven(drive, kind, q[name], qd[name], t)
        joints[name] = _started(sm.Joint(type=kind, **entries), q[name], qd[name])
        parts.append(child)
    rng = stream(seed, "world")
    ground = sm.Ground({name: rp.numbers(rng, 3, 0.5) for name in ("a", "b", "s")})
    gravity = tuple(9.81 * x for x in rp.numbers(rng, 3))
    bodies = {p: rp.body(stream(seed, p)) for p in parts[1:]}
    forces = rp.applied(stream(seed, "forces"), parts) if loads else {}
    inputs = {"push": sm.Input(start=float(rng.uniform(-2, 2)))}
    scene = sm.Scene(bodies, joints, f"tree{seed}", gravity=gravity, ground=ground, forces=forces, inputs=inputs)
    return Case(scene, q, qd, t, tuple(joints))


def _extras(rng, kind: str) -> dict:
    pitch = {"pitch": float(rng.choice([-1, 1]) * rng.uniform(0.1, 1.0))} if REGISTRY[kind].pitched else {}
    return {"pin": str(rng.choice(["inboard", "outboard"])), **pitch}


def _driven(rng, kind: str, q, qd, t: float):
    """A drive of one freedom. The function sets q and qd of this freedom in the case."""
    n = freedoms(kind)
    k = int(rng.integers(of(kind).scalars))
    drive, q[k], qd[k] = rp.drive(rng, t)
    return drive if n == 1 else tuple(drive if i == k else None for i in range(n))


def _started(joint: sm.Joint, q, qd) -> sm.Joint:
    """The joint with its start values. Values that a drive gives are not written."""
    if len(qd) == 0 or joint.drive is not None:
        return joint
    one = len(q) == 1
    start = sm.Start(q=float(q[0]) if one else tuple(map(float, q)), qd=float(qd[0]) if one else tuple(map(float, qd)))
    return replace(joint, start=start)


# -- loops -----------------------------------------------------------------------------------------------------------


def random_loop(
    seed: int | str,
    loops: int = 1,
    bodies: int | None = None,
    drives: float = 0.3,
    closing: tuple[str, ...] = tuple(k for k in USUAL_TYPES if k in CLOSING_TYPES),
    cut: bool | None = None,
    **options,
) -> Case:
    """A random tree with ``loops`` additional joints of the types ``closing``. The loops are closed at the state, with consistent
    rates, and at least one freedom is left. ``cut``: value of the key ``cut`` of the additional joints.

    Rows of the loops are independent and well conditioned. Options as for ``random_tree``.
    """
    for attempt in range(200):
        count = bodies or int(stream(seed, attempt, "loop bodies").integers(2, 7))
        case = random_tree(f"{seed}_{attempt}", count, drives=0.0, **options)
        for k in range(loops):
            case = _close(case, (seed, attempt, k), closing, {"cut": cut, **options}) if case else None
        if case:
            case, rng = _projected(case), stream(seed, "loop drive")
            return _drive_one(rng, case) if rng.random() < drives else case
    raise RuntimeError(f"no loop found for seed {seed}")


def _close(case: Case, names: tuple, closing, options: dict) -> Case | None:
    """An additional joint between two parts that no joint connects yet; None if no type fits."""
    parts = [GROUND, *case.scene.bodies]
    state = case.state()
    joined = {frozenset((f.inboard, f.outboard)) for f in state.frames.values()}
    for attempt in range(10):
        a, b = (str(x) for x in stream(*names, attempt, "ends").choice(parts, 2, replace=False))
        if frozenset((a, b)) in joined:
            continue
        kind, name = chosen(closing, *names, attempt), f"loop{len(case.scene.joints) - len(case.tree) + 1}"
        joint, q = _closing_joint(stream(*names, attempt, kind), state, kind, a, b)
        rub = stream(*names, attempt, kind, "friction")
        if kind in rp.RUBBING_TYPES and rub.random() < options.get("friction", 0.4):
            how = {k: options[k] for k in ("laws", "adams") if k in options}
            joint = replace(joint, friction=rp.friction(rub, kind, **how))
        some = stream(*names, attempt, kind, "devices")
        if some.random() < options.get("devices", 0.4):
            joint = replace(joint, **rp.devices(some, kind, q))
        joint = replace(joint, cut=options["cut"])
        scene = replace(case.scene, joints={**case.scene.joints, name: joint}, name=f"{case.scene.name}_{name}")
        new = Case(scene, {**case.q, name: q}, case.qd, case.t, case.tree)
        G = loop_matrix(new)
        if G.shape[0] < G.shape[1] and np.linalg.svd(G, compute_uv=False)[-1] > 0.05:
            return new
    return None


def _closing_joint(rng, state: State, kind: str, a: str, b: str) -> tuple[sm.Joint, np.ndarray]:
    """A joint of a type between a and b. Its outboard side is placed according to a random q. A rod joins any two points."""
    if of(kind).line:
        points = [np.array(rp.numbers(rng, 3, 0.4)) for _ in (a, b)]
        there = [state.r[body] + state.R[body] @ p for body, p in zip((a, b), points, strict=True)]
        ends = (sm.Side(body, tuple(map(float, p))) for body, p in zip((a, b), points, strict=True))
        return sm.Joint(kind, *ends, length=float(np.linalg.norm(there[1] - there[0]))), np.zeros(0)
    q, _ = rp.coordinates(rng, kind)
    extras = _extras(rng, kind)
    local = np.array(rp.numbers(rng, 3, 0.4))
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    frame[:, 2] = np.cross(frame[:, 0], frame[:, 1])
    R, s = joint_transform(sm.Joint(type=kind, inboard=a, outboard=b, **extras), q)
    A = state.R[a] @ frame
    p = state.r[a] + state.R[a] @ local + A @ s
    other, there = state.R[b].T @ A @ R, state.R[b].T @ (p - state.r[b])

    def side(body, point, F):
        return sm.Side(body, *(tuple(float(v) for v in x) for x in (point, F[:, 0], F[:, 1])))

    return sm.Joint(type=kind, inboard=side(a, local, frame), outboard=side(b, there, other), **extras), q


def loop_matrix(case: Case) -> np.ndarray:
    """Velocity closure of all loop joints as a matrix over the rates of the tree joints."""
    zero = {n: np.zeros_like(case.qd[n]) for n in case.tree}
    columns = []
    for name in case.tree:
        for k in range(len(case.qd[name])):
            one = zero | {name: np.eye(len(case.qd[name]))[k]}
            state = forward(case.scene, {n: case.q[n] for n in case.tree}, one, case.t)
            columns.append(np.concatenate([closure(state, n)[1] for n in state.loops] or [np.zeros(0)]))
    return np.array(columns).T if columns else np.zeros((1, 0))


def _projected(case: Case) -> Case:
    """The case with its rates moved to the nearest rates that the loops allow, in tree joints, loop joints and start values."""
    G = loop_matrix(case)
    flat = np.concatenate([case.qd[n] for n in case.tree])
    flat = flat - np.linalg.pinv(G) @ (G @ flat)
    ends = np.cumsum([len(case.qd[n]) for n in case.tree])[:-1]
    qd = dict(zip(case.tree, np.split(flat, ends), strict=True))
    state = forward(case.scene, {n: case.q[n] for n in case.tree}, qd, case.t)
    joints = {n: _started(j, case.q[n], qd[n]) if n in case.tree else j for n, j in case.scene.joints.items()}
    for name in state.loops:
        qd[name] = measured(state, name)[1]
    q = {n: case.q[n] if n in case.tree else measured(state, n)[0] for n in case.scene.joints}
    return Case(replace(case.scene, joints=joints), q, qd, case.t, case.tree)


def _drive_one(rng, case: Case) -> Case:
    """Drive one freedom of the loops steadily, if the rates leave a freedom that is independent of the closure."""
    G, at = loop_matrix(case), 0
    choices = []
    for name in case.tree:
        for k in range(len(case.qd[name])):
            row = np.eye(G.shape[1])[at]
            at += 1
            if k < of(case.scene.joints[name].type).scalars and np.linalg.svd(np.vstack([G, row]), compute_uv=False)[-1] > 0.05:
                choices.append((name, k))
    if not choices:
        return case
    name, k = choices[rng.integers(len(choices))]
    rate, start = float(case.qd[name][k]), float(case.q[name][k])
    drive = sm.Drive(constant=sm.Constant(rate=rate, start=start - rate * case.t))
    n = freedoms(case.scene.joints[name].type)
    entries = drive if n == 1 else tuple(drive if i == k else None for i in range(n))
    joint = replace(case.scene.joints[name], drive=entries, start=None)
    assert len(per_freedom(entries, n)) == n
    return replace(case, scene=replace(case.scene, joints={**case.scene.joints, name: joint}))
