"""A joint described from the other side. Inboard and outboard change places, which must not change the motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import joint_frames
from tests.reference.mechanics.joint_constraints import free_picker, freedoms, joint_coordinates, joint_rates, joint_transform, of
from tests.reference.mechanics.rotation import cross
from tests.reference.mechanics.time_signals import per_freedom
from tests.reference.scenes.frame_changes import scaled_load, triple
from tests.reference.scenes.random_scenes import Case, _started
from tests.reference.scenes.result_table import Moved
from trunnion.scene.data_classes import scene as sm

SWAP = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""New frame of a universal joint's side in the old one: e1 and e2 change places."""


@dataclass(frozen=True)
class SwappedJoint:
    """A joint described from its other side. rates: matrix from the old rates to the new rates (freedoms x freedoms); q: new
    coordinates."""

    rates: np.ndarray
    q: np.ndarray
    to_new: np.ndarray  # takes components in the old inboard joint frame to the new inboard joint frame


def swap_joint_sides(case: Case, name: str) -> Moved:
    """Swap the sides of joint ``name``. ValueError if the swapped joint has no description: one-sided types, and devices on
    freedoms whose sign is not the only change."""
    joint = case.scene.joints[name]
    if of(joint.type).one_sided:
        raise ValueError(f"{name}: a {joint.type} joint means something else from the other side")
    devices = (joint.spring, joint.damping, joint.end_stops, joint.drive, joint.effort)
    if not of(joint.type).swaps_by_sign and any(x is not None for x in devices):
        raise ValueError(f"{name}: devices of a {joint.type} joint cannot be described from the other side")
    how = _coordinates_after_swap(joint, case.q[name])
    qd = how.rates @ case.qd[name] if len(case.qd[name]) else case.qd[name]
    new = _started(_swapped(case.scene, joint), how.q, qd)
    joints = {n: new if n == name else j for n, j in case.scene.joints.items()}
    moved = Case(replace(case.scene, joints=joints), case.q | {name: how.q}, case.qd | {name: qd}, case.t, case.tree)
    return Moved(moved, _undo(case, name, how))


def _coordinates_after_swap(joint, q) -> SwappedJoint:
    """For the other side, s' = -R^T s, and the rates are -R^T (s_dot - omega x s), -R^T omega. The reverse map has the same
    formulas."""
    R, s = joint_transform(joint, q)
    if of(joint.type).crossed:
        return SwappedJoint(-SWAP[:2, :2], -np.asarray(q)[::-1], SWAP.T @ R.T)
    rates = []
    for one in np.eye(freedoms(joint.type)):
        turn, slide = joint_rates(joint, R, one)
        rates.append(np.r_[-R.T @ (slide - cross(turn, s)), -R.T @ turn])
    back = joint_coordinates(joint, R.T, -R.T @ s)
    k = of(joint.type).scalars
    angles = [i for i, d in enumerate(of(joint.type).free[:k]) if d >= 3]
    back[angles] = -np.asarray(q)[angles]  # angles computed from poses would lie within one turn
    return SwappedJoint(free_picker(joint) @ np.array(rates).reshape(-1, 6).T, back, R.T)


def _swapped(scene, joint: sm.Joint) -> sm.Joint:
    """The joint with sides, pin, devices and radii described from the other side."""
    f, universal = joint_frames(scene, joint), of(joint.type).crossed
    turn = SWAP if universal else np.eye(3)
    sides = {}
    for which, body, p, F in (("inboard", f.outboard, f.p_out, f.F_out), ("outboard", f.inboard, f.p_in, f.F_in)):
        A = F @ turn
        sides[which] = sm.Side(body, triple(p), axis=triple(A[:, 0]), reference=triple(A[:, 1]))
    other = {"inboard": "outboard", "outboard": "inboard"}
    pin = joint.pin if universal else other[joint.pin]
    ends = other.get(joint.ends)
    new = replace(joint, **sides, axis=None, reference=None, pin=pin, ends=ends, start=None)
    g = joint.friction
    if universal and g is not None:
        new = replace(new, friction=replace(g, radius=_flipped(g.radius), half_length=_flipped(g.half_length)))
    n = freedoms(joint.type)
    flips = {
        "spring": lambda x: replace(x, rest=-x.rest),
        "damping": lambda x: x,
        "end_stops": lambda x: replace(x, lower=_minus(x.upper), upper=_minus(x.lower)),
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


def _undo(case: Case, name: str, how: SwappedJoint) -> Callable:
    """Results of joint ``name`` mapped back to the old side. Contact angles are left out if their frame changed."""
    joint, T = case.scene.joints[name], how.to_new.T
    universal, ball = of(joint.type).crossed, of(joint.type).ball
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
    """Contribution of the changing map of rates to the new accelerations (for a travel measured in a part that turns)."""
    R, s = joint_transform(joint, q)
    w, slide = joint_rates(joint, R, qd)
    return free_picker(joint) @ np.r_[R.T @ (2 * cross(w, slide) - cross(w, cross(w, s))), np.zeros(3)]
