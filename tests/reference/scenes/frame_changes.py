"""Equivalent descriptions of a mechanism by other orders, world axes and body frames. Each function returns a Moved case."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import GROUND, joint_frames, part
from tests.reference.mechanics.rotation import random_rotation
from tests.reference.mechanics.time_signals import load_value
from tests.reference.scenes.random_scenes import Case
from tests.reference.scenes.result_table import Moved
from trunnion.scene.data_classes import scene as sm


def triple(x) -> tuple[float, float, float]:
    """A vector as a tuple of three Python floats, as scenes hold them."""
    return tuple(float(v) for v in x)


def shuffled(case: Case, seed: int) -> Moved:
    """Bodies, joints and loads in another order."""
    rng = np.random.default_rng(seed)

    def mixed(d):
        return {k: d[k] for k in rng.permutation(sorted(d)).tolist()}

    s = case.scene
    scene = replace(s, bodies=mixed(s.bodies), joints=mixed(s.joints), forces=mixed(s.forces))
    return Moved(replace(case, scene=scene), lambda t: t)


def scaled_load(scene, load, factor: float):
    """A load times a number; an input becomes its start value."""
    if hasattr(load, "input") or isinstance(load, (int, float)):
        return factor * load_value(scene, load, 0.0)
    if load.ramp is not None:
        return replace(load, ramp=replace(load.ramp, start=factor * load.ramp.start, end=factor * load.ramp.end))
    if load.harmonic is not None:
        h = load.harmonic
        return replace(load, harmonic=replace(h, amplitude=factor * h.amplitude, offset=factor * h.offset))
    return replace(load, table=replace(load.table, value=tuple(factor * v for v in load.table.value)))


def turned_loads(scene, name: str, load, Q: np.ndarray) -> dict:
    """A force or torque with its vector turned by Q. The result has one load for each component, because signals cannot be
    added."""
    key = load.type
    out = {}
    for k, value in enumerate(getattr(load, key)):
        vector = tuple(scaled_load(scene, value, float(Q[i, k])) for i in range(3))
        out[f"{name}_{k}"] = replace(load, **{key: vector})
    return out


def explicit_side(scene, joint, which: str, A: np.ndarray, shift: np.ndarray) -> sm.Side:
    """A side given by numbers, in a frame with x_new = A x_old + shift."""
    f = joint_frames(scene, joint)
    body, p, F = (f.inboard, f.p_in, f.F_in) if which == "inboard" else (f.outboard, f.p_out, f.F_out)
    return sm.Side(body, triple(A @ p + shift), axis=triple(A @ F[:, 0]), reference=triple(A @ F[:, 1]))


def rotated(case: Case, seed: int) -> Moved:
    """The whole world turned, including gravity and everything that is fixed to the ground."""
    Q = random_rotation(np.random.default_rng(seed))
    s, joints, forces = case.scene, {}, {}
    for name, joint in s.joints.items():
        f = joint_frames(s, joint)
        which = {"inboard": f.inboard, "outboard": f.outboard}
        new = {w: explicit_side(s, joint, w, Q, np.zeros(3)) for w, body in which.items() if body == GROUND}
        joints[name] = replace(joint, **new)
    for name, load in s.forces.items():
        world = getattr(load, "frame", None) == "world"
        forces |= turned_loads(s, name, load, Q) if world else {name: load}
    ground = sm.Ground({k: triple(Q @ np.array(p)) for k, p in s.ground.points.items()})
    scene = replace(s, joints=joints, forces=forces, ground=ground, gravity=triple(Q @ np.array(s.gravity)))

    def back(t):
        return {k: Q.T @ v if k[1] in ("acceleration", "angular_acceleration") else v for k, v in t.items()}

    return Moved(replace(case, scene=scene), back)


def reframed(case: Case, seed: int) -> Moved:
    """Every body in another frame, x_new = A x_old + shift. Shapes become explicit inertias."""
    rng, s = np.random.default_rng(seed), case.scene
    moves = {b: (random_rotation(rng), rng.uniform(-0.5, 0.5, 3)) for b in s.bodies}
    moves[GROUND] = (np.eye(3), np.zeros(3))
    bodies = {name: _reframed_body(body, *moves[name]) for name, body in s.bodies.items()}
    joints = {}
    for name, joint in s.joints.items():
        f = joint_frames(s, joint)
        new = {w: explicit_side(s, joint, w, *moves[getattr(f, w)]) for w in ("inboard", "outboard")}
        joints[name] = replace(joint, **new)
    forces = {}
    for name, load in s.forces.items():
        if load.type == "spring_damper":
            ends = tuple(e if "." in e or e == GROUND else f"{e}.old_origin" for e in load.between)
            forces[name] = replace(load, between=ends)
        elif load.frame == "body":
            forces |= turned_loads(s, name, load, moves[load.on.partition(".")[0]][0])
        else:
            forces[name] = load
    return Moved(replace(case, scene=replace(s, bodies=bodies, joints=joints, forces=forces)), lambda t: t)


def _reframed_body(body: sm.Body, A: np.ndarray, shift: np.ndarray) -> sm.Body:
    p = part(body)
    J = A @ p.inertia @ A.T
    inertia = tuple(float(x) for x in (*np.diag(J), J[0, 1], J[0, 2], J[1, 2]))
    points = {k: triple(A @ np.array(x) + shift) for k, x in body.points.items()} | {"old_origin": triple(shift)}
    return sm.Body(mass=p.mass, inertia=inertia, center=triple(A @ p.center + shift), points=points)
