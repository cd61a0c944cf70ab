"""Random scenes with consistent states: trees of every joint type, and closed loops made from them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from engine.scene import model as sm

from . import random_parts as rp
from .bodies import GROUND
from .joint_rows import FREE_DIRECTIONS, SCALAR_COORDINATES, freedoms, joint_transform
from .kinematics import State, closure, forward, measured
from .signals import per_freedom

ALL_TYPES = tuple(FREE_DIRECTIONS)
CLOSING_TYPES = ("spherical", "universal", "cylindrical", "revolute", "planar", "prismatic", "screw", "fixed")


@dataclass(frozen=True)
class Case:
    """A scene and one consistent state of it at time t: q and qd of every joint that has coordinates.

    ``tree``: the joints the state was made from; the others close loops.
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


def random_tree(
    seed: int,
    bodies: int | None = None,
    types: tuple[str, ...] = ALL_TYPES,
    friction: float = 0.4,
    devices: float = 0.4,
    drives: float = 0.15,
    loads: bool = True,
    t: float = 0.0,
    laws: tuple[str, ...] = ("regularized", "viscous"),
    adams: float = 0.2,
) -> Case:
    """A random tree of 1 to 6 bodies; ``friction``, ``devices``, ``drives``, ``adams`` are probabilities per joint."""
    rng = np.random.default_rng(seed)
    number = bodies or int(rng.integers(1, 7))
    parts, joints, q, qd = [GROUND], {}, {}, {}
    for i in range(number):
        name, kind, parent, child = f"j{i + 1}", str(rng.choice(types)), str(rng.choice(parts)), f"b{i + 1}"
        q[name], qd[name] = rp.coordinates(rng, kind)
        ends = (parent, child) if rng.random() < 0.5 else (child, parent)
        entries = rp.sides(rng, kind, *ends) | _extras(rng, kind)
        if rng.random() < devices:
            entries |= rp.devices(rng, kind, q[name])
        if kind in rp.RUBBING_TYPES and rng.random() < friction:
            entries["friction"] = rp.friction(rng, kind, laws, adams)
        if SCALAR_COORDINATES.get(kind, freedoms(kind)) and rng.random() < drives:
            entries["drive"] = _driven(rng, kind, q[name], qd[name], t)
        joints[name] = _started(sm.Joint(type=kind, **entries), q[name], qd[name])
        parts.append(child)
    ground = sm.Ground({name: rp.numbers(rng, 3, 0.5) for name in ("a", "b", "s")})
    bodies = {p: rp.body(rng) for p in parts[1:]}
    gravity = tuple(9.81 * x for x in rp.numbers(rng, 3))
    forces = rp.applied(rng, parts) if loads else {}
    inputs = {"push": sm.Input(start=float(rng.uniform(-2, 2)))}
    scene = sm.Scene(bodies, joints, f"tree{seed}", gravity=gravity, ground=ground, forces=forces, inputs=inputs)
    return Case(scene, q, qd, t, tuple(joints))


def _extras(rng, kind: str) -> dict:
    pitch = {"pitch": float(rng.choice([-1, 1]) * rng.uniform(0.1, 1.0))} if kind == "screw" else {}
    return {"pin": str(rng.choice(["inboard", "outboard"])), **pitch}


def _driven(rng, kind: str, q, qd, t: float):
    """A drive of one freedom; sets its q and qd in place."""
    n = freedoms(kind)
    k = int(rng.integers(SCALAR_COORDINATES.get(kind, n)))
    drive, q[k], qd[k] = rp.drive(rng, t)
    return drive if n == 1 else tuple(drive if i == k else None for i in range(n))


def _started(joint: sm.Joint, q, qd) -> sm.Joint:
    """The joint with its start values written (not where a drive gives them)."""
    if len(qd) == 0 or joint.drive is not None:
        return joint
    one = len(q) == 1
    start = sm.Start(q=float(q[0]) if one else tuple(map(float, q)), qd=float(qd[0]) if one else tuple(map(float, qd)))
    return replace(joint, start=start)


# -- loops -----------------------------------------------------------------------------------------------------------


def random_loop(seed: int, loops: int = 1, bodies: int | None = None, drives: float = 0.3, **options) -> Case:
    """A random tree with ``loops`` more joints, closed at its state, with consistent rates and a freedom left or more.

    Rows of the loops are independent and well conditioned. Options as for ``random_tree``.
    """
    rng = np.random.default_rng([seed, 77])
    for attempt in range(200):
        count = bodies or int(rng.integers(2, 7))
        case = random_tree(seed * 1000 + attempt, count, drives=0.0, **options)
        for _ in range(loops):
            case = _close(rng, case, options) if case else None
        if case:
            case = _projected(case)
            return _drive_one(rng, case) if rng.random() < drives else case
    raise RuntimeError(f"no loop found for seed {seed}")


def _close(rng, case: Case, options: dict) -> Case | None:
    """One more joint between two parts that no joint joins yet; None where nothing fits."""
    parts = [GROUND, *case.scene.bodies]
    state = case.state()
    joined = {frozenset((f.inboard, f.outboard)) for f in state.frames.values()}
    for _ in range(10):
        a, b = (str(x) for x in rng.choice(parts, 2, replace=False))
        kind, name = str(rng.choice(CLOSING_TYPES)), f"loop{len(case.scene.joints) - len(case.tree) + 1}"
        if frozenset((a, b)) in joined:
            continue
        joint, q = _closing_joint(rng, state, kind, a, b)
        if kind in rp.RUBBING_TYPES and rng.random() < options.get("friction", 0.4):
            how = {k: options[k] for k in ("laws", "adams") if k in options}
            joint = replace(joint, friction=rp.friction(rng, kind, **how))
        scene = replace(case.scene, joints={**case.scene.joints, name: joint}, name=f"{case.scene.name}_{name}")
        new = Case(scene, {**case.q, name: q}, case.qd, case.t, case.tree)
        G = loop_matrix(new)
        if G.shape[0] < G.shape[1] and np.linalg.svd(G, compute_uv=False)[-1] > 0.05:
            return new
    return None


def _closing_joint(rng, state: State, kind: str, a: str, b: str) -> tuple[sm.Joint, np.ndarray]:
    """A joint of a type between a and b whose outboard side is put where a random q wants it."""
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
    """The case with rates moved to the nearest ones the loops allow; loop joints get theirs, start values follow."""
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
    """Drive one freedom of the loops steadily, if the rates leave one that is independent of the closure."""
    G, at = loop_matrix(case), 0
    choices = []
    for name in case.tree:
        for k in range(len(case.qd[name])):
            row = np.eye(G.shape[1])[at]
            at += 1
            scalar = SCALAR_COORDINATES.get(case.scene.joints[name].type, freedoms(case.scene.joints[name].type))
            if k < scalar and np.linalg.svd(np.vstack([G, row]), compute_uv=False)[-1] > 0.05:
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
