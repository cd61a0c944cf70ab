"""A joint said from the other side: inboard and outboard swapped, which must not change what the mechanism does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from engine.scene import model as sm

from .bodies import joint_frames
from .joint_rows import SCALAR_COORDINATES, freedoms, joint_rates, joint_transform
from .random_scenes import Case, _started
from .rotation import cross
from .signals import per_freedom
from .transforms import scaled_load, triple
from .values import Moved

SWAP = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""New frame of a universal joint's side in the old one: e1 and e2 change places."""


@dataclass(frozen=True)
class Reversal:
    """Linear map of the rates, and what follows from it."""

    rates: np.ndarray
    q: np.ndarray
    to_new: np.ndarray  # old inboard joint components -> new inboard joint components


def reversed_joint(case: Case, name: str) -> Moved:
    """Swap the sides of joint ``name``; impossible with devices on freedoms of planar, free and spherical joints."""
    joint = case.scene.joints[name]
    many = joint.type in ("planar", "free", "spherical")
    if many and any(x is not None for x in (joint.spring, joint.damping, joint.stops, joint.drive, joint.effort)):
        raise ValueError(f"{name}: devices of a {joint.type} joint cannot be said from the other side")
    how = _reversal(joint, case.q[name])
    qd = how.rates @ case.qd[name] if len(case.qd[name]) else case.qd[name]
    new = _started(_swapped(case.scene, joint), how.q, qd)
    joints = {n: new if n == name else j for n, j in case.scene.joints.items()}
    moved = Case(replace(case.scene, joints=joints), case.q | {name: how.q}, case.qd | {name: qd}, case.t, case.tree)
    return Moved(moved, _undo(case, name, how))


def _reversal(joint, q) -> Reversal:
    kind = joint.type
    R, s = joint_transform(joint, q)
    if kind == "universal":
        return Reversal(-SWAP[:2, :2], -np.asarray(q)[::-1], SWAP.T @ R.T)
    if kind in ("spherical", "free"):
        k = SCALAR_COORDINATES[kind]
        conjugate = np.asarray(q)[k:] * [1, -1, -1, -1]
        ball = -R.T
        if kind == "spherical":
            return Reversal(ball, conjugate, R.T)
        # s' = -R^T s, rate -R^T s_dot - R^T (s x omega)
        across = np.array([cross(s, e) for e in np.eye(3)]).T
        rates = np.block([[-R.T, -R.T @ across], [np.zeros((3, 3)), ball]])
        return Reversal(rates, np.r_[-R.T @ s, conjugate], R.T)
    if kind == "planar":
        back, angle = -R.T @ s, -q[2]
        spin = -R.T @ cross(s, [1.0, 0.0, 0.0])
        rates = np.block([[-R.T[1:, 1:], spin[1:, None]], [np.zeros((1, 2)), -np.ones((1, 1))]])
        return Reversal(rates, np.array([back[1], back[2], angle]), R.T)
    return Reversal(-np.eye(freedoms(kind)), -np.asarray(q), R.T)


def _swapped(scene, joint: sm.Joint) -> sm.Joint:
    """The same joint with sides, pin, devices and radii said from the other side."""
    f, universal = joint_frames(scene, joint), joint.type == "universal"
    turn = SWAP if universal else np.eye(3)
    sides = {}
    for which, body, p, F in (("inboard", f.outboard, f.p_out, f.F_out), ("outboard", f.inboard, f.p_in, f.F_in)):
        A = F @ turn
        sides[which] = sm.Side(body, triple(p), axis=triple(A[:, 0]), reference=triple(A[:, 1]))
    other = {"inboard": "outboard", "outboard": "inboard"}
    pin = joint.pin if universal else other[joint.pin]
    new = replace(joint, **sides, axis=None, reference=None, pin=pin, start=None)
    g = joint.friction
    if universal and g is not None:
        new = replace(new, friction=replace(g, radius=_flipped(g.radius), half_length=_flipped(g.half_length)))
    n = freedoms(joint.type)
    flips = {
        "spring": lambda x: replace(x, rest=-x.rest),
        "damping": lambda x: x,
        "stops": lambda x: replace(x, lower=_minus(x.upper), upper=_minus(x.lower)),
        "drive": _minus_drive,
        "effort": lambda x: scaled_load(scene, x, -1.0),
    }
    return replace(new, **{key: _mirrored(getattr(joint, key), n, flip, universal) for key, flip in flips.items()})


def _mirrored(value, n: int, flip: Callable, backwards: bool):
    if value is None:
        return None
    entries = [None if x is None else flip(x) for x in per_freedom(value, n)]
    return entries[0] if n == 1 else tuple(entries[::-1] if backwards else entries)


def _flipped(value):
    return tuple(value[::-1]) if isinstance(value, (tuple, list)) else value


def _minus(x):
    return None if x is None else -x


def _minus_drive(drive: sm.Drive) -> sm.Drive:
    if drive.constant is not None:
        c = drive.constant
        return sm.Drive(constant=replace(c, rate=-c.rate, start=-c.start))
    if drive.ramp is not None:
        r = drive.ramp
        return sm.Drive(ramp=replace(r, start=-r.start, end=-r.end, origin=-r.origin))
    if drive.harmonic is not None:
        h = drive.harmonic
        return sm.Drive(harmonic=replace(h, amplitude=-h.amplitude, offset=-h.offset))
    return sm.Drive(table=replace(drive.table, value=tuple(-v for v in drive.table.value)))


def _undo(case: Case, name: str, how: Reversal) -> Callable:
    """Results of joint ``name`` said from the old side again; contact angles are left out where their frame changed."""
    joint, T = case.scene.joints[name], how.to_new.T
    universal, ball = joint.type == "universal", joint.type == "spherical"
    order = [2, 3, 0, 1] if universal else slice(None)
    extra = _coriolis(joint, case.q[name], case.qd[name])

    def efforts(x):
        return -x[::-1] if universal else -x

    maps = {
        "qdd": lambda x: np.linalg.solve(how.rates, x - extra) if len(x) else x,
        "reaction.force": lambda x: -T @ x,
        "reaction.torque": lambda x: -T @ x,
        "friction": lambda x: how.rates.T @ x,
        "drive.effort": efforts,
        "normal_force": lambda x: x[order],
        "normal": lambda x: x[order] @ T.T,
        "angle": lambda x: x,
    }

    def back(t):
        mine = {k: maps[k[1]](v) for k, v in t.items() if k[0] == name}
        if universal or ball:
            mine.pop((name, "angle"), None)
        return {k: v for k, v in t.items() if k[0] != name} | mine

    return back


def _coriolis(joint, q, qd) -> np.ndarray:
    """What the change of the map of the rates adds to the new accelerations (planar and free joints only)."""
    if joint.type not in ("planar", "free"):
        return np.zeros(freedoms(joint.type))
    R, s = joint_transform(joint, q)
    w, slide = joint_rates(joint, R, qd)
    a = R.T @ (2 * cross(w, slide) - cross(w, cross(w, s)))
    return np.r_[a, np.zeros(3)] if joint.type == "free" else np.r_[a[1:], 0.0]
