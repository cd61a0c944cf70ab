"""Six directions of relative motion per joint, with their rows and rates of change. Each direction is free or constrained.

Directions 0..2: translation of the outboard point seen from the inboard part, along e1, e2, e3 of the inboard frame. Directions
3..5: relative rotation about the same axes; with crossed axes (universal joint): about u1, u2, u1 x u2. A direction is a force F at
the outboard point and a torque T, which act on the outboard part, and opposite on the inboard part. Its rate is the power of F and
T at unit size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.reference.mechanics.rotation import cross, matrix_from_quaternion, quaternion_from_matrix, rotation_about


@dataclass(frozen=True, kw_only=True)
class Reference:
    """The reference's declaration of a joint type. The functions of this file use only these declarations.

    free       directions along which the joint is free, in the order of its rates; travels come before turns.
    ball       the turns are a quaternion, the last four coordinates (free must end with 3, 4, 5).
    crossed    the joint turns about two axes at a right angle, the first fixed inboard, the second outboard.
    lead       a pitch ties the travel along e1 to the angle.
    one_sided  the joint differs if its two sides change places (a slot is in one part, the pin on the other).
    line       the joint only keeps the distance of two points, and carries no body. Its only direction is the line between them.
    rubs       the contacts with friction, an entry of PAIRS in ``joint_friction``; "": none.
    """

    free: tuple[int, ...] = ()
    ball: bool = False
    crossed: bool = False
    lead: bool = False
    one_sided: bool = False
    line: bool = False
    rubs: str = ""

    @property
    def scalars(self) -> int:
        """Coordinates that are single numbers: all coordinates, or those before the quaternion."""
        return len(self.free) - 3 * self.ball

    @property
    def swaps_by_sign(self) -> bool:
        """True if swapping the joint's inboard and outboard sides changes only the signs of its rates. (With crossed axes, swapping
        changes their order, too.)"""
        return self.crossed or len({d % 3 for d in self.free}) <= 1


TYPES = {
    "fixed": Reference(),
    "revolute": Reference(free=(3,), rubs="journal"),
    "prismatic": Reference(free=(0,), rubs="sleeve"),
    "cylindrical": Reference(free=(0, 3), rubs="shaft"),
    "screw": Reference(free=(3,), lead=True),
    "universal": Reference(free=(3, 4), crossed=True, rubs="cross"),
    "spherical": Reference(free=(3, 4, 5), ball=True, rubs="ball"),
    "planar": Reference(free=(1, 2, 3)),
    "free": Reference(free=(0, 1, 2, 3, 4, 5), ball=True),
    "point_on_line": Reference(free=(0, 3, 4, 5), ball=True, one_sided=True),
    "point_on_plane": Reference(free=(1, 2, 3, 4, 5), ball=True, one_sided=True),
    "rod": Reference(line=True),
}
"""The properties are written out independently of ``trunnion.elements.joints``, so that the comparison of the two is meaningful."""


def of(kind: str) -> Reference:
    """The reference of a joint type. For a type without reference, LookupError names the missing entry."""
    if kind not in TYPES:
        raise LookupError(
            f'joint type "{kind}" has no independent reference: add an entry to TYPES in tests/reference/mechanics/'
            "joint_constraints.py (the directions it is free along; not copied from engine/elements/joints). What "
            "``Reference`` cannot say needs lines in joint_transform, joint_coordinates, joint_rates and position_residual"
        )
    return TYPES[kind]


@dataclass(frozen=True)
class Directions:
    """k directions of a joint at a state: their forces F and torques T (k x 3 each, world), their rates (k), and the bias (k) of
    d(rate)/dt = rows times accelerations + bias."""

    F: np.ndarray
    T: np.ndarray
    rate: np.ndarray
    bias: np.ndarray

    def pick(self, P: np.ndarray) -> Directions:
        """Linear combinations P (n x 6) of the six directions."""
        return Directions(P @ self.F, P @ self.T, P @ self.rate, P @ self.bias)


def freedoms(kind: str) -> int:
    """Number of rates of a joint type."""
    return len(of(kind).free)


def lead(joint) -> float:
    """Travel per angle of a screw."""
    return joint.pitch / (2 * np.pi)


def free_picker(joint) -> np.ndarray:
    """Matrix (freedoms x 6) that selects a joint's freedoms from its six directions, in the order of its rates. A rod has one
    direction and no freedom."""
    if of(joint.type).line:
        return np.zeros((0, 1))
    return np.eye(6)[list(of(joint.type).free)].reshape(-1, 6)


def constraint_picker(joint) -> np.ndarray:
    """Matrix (constraints x 6) that selects a joint's constrained directions. For a screw, a row ties the travel to the angle."""
    if of(joint.type).line:
        return np.eye(1)
    rows = np.eye(6)[[k for k in range(6) if k not in of(joint.type).free]].reshape(-1, 6)
    if of(joint.type).lead:
        rows[0, 3] = -lead(joint)
    return rows


def directions(state, name: str) -> Directions:
    """The six directions of joint ``name`` with rates and biases, by hand differentiation of the relative motion."""
    j = state.joint_pose(name)
    if of(state.scene.joints[name].type).line:
        return _line(state, j)
    wi, wo = state.omega[j.inboard], state.omega[j.outboard]
    rho_i, rho_o = j.p_out - state.c[j.inboard], j.p_out - state.c[j.outboard]
    slide = state.v[j.outboard] + cross(wo, rho_o) - state.v[j.inboard] - cross(wi, rho_i)
    centripetal = cross(wo, cross(wo, rho_o)) - cross(wi, cross(wi, rho_i)) - 2 * cross(wi, slide)
    turn = wo - wi
    if of(state.scene.joints[name].type).crossed:
        u1, u2 = j.A_in[:, 0], j.A_out[:, 1]
        du1, du2 = cross(wi, u1), cross(wo, u2)
        B = np.array([u1, u2, cross(u1, u2)])
        dB = np.array([du1, du2, cross(du1, u2) + cross(u1, du2)])
    else:
        B = j.A_in.T
        dB = np.array([cross(wi, b) for b in B])
    zero = np.zeros((3, 3))
    F, T = np.vstack([j.A_in.T, zero]), np.vstack([zero, B])
    return Directions(F, T, np.r_[j.A_in.T @ slide, B @ turn], np.r_[j.A_in.T @ centripetal, dB @ turn])


def _line(state, j) -> Directions:
    """The line between two points: d(|s|)/dt = n.v, and its rate n.dv/dt + (v.v - (n.v)^2) / |s|; v: difference of velocities."""
    s = j.p_out - j.p_in
    far = float(np.sqrt(s @ s))
    n = s / far
    v, turned = np.zeros(3), np.zeros(3)
    for body, p, sign in ((j.outboard, j.p_out, 1.0), (j.inboard, j.p_in, -1.0)):
        w, arm = state.omega[body], p - state.c[body]
        v += sign * (state.v[body] + cross(w, arm))
        turned += sign * cross(w, cross(w, arm))
    rate = n @ v
    return Directions(n[None, :], np.zeros((1, 3)), np.array([rate]), np.array([n @ turned + (v @ v - rate**2) / far]))


def position_residual(joint, R: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Constraint functions whose rates are the constrained directions (at a closed state), in their order.

    R takes outboard to inboard joint components, s is the travel in inboard components.
    """
    kind = of(joint.type)
    if kind.line:
        return np.array([np.sqrt(s @ s) - joint.length])
    if kind.crossed:
        return np.r_[s, -R[0, 1]]
    trans = [s[k] for k in range(3) if k not in kind.free]
    if kind.lead:
        angle = np.arctan2(R[2, 1], R[1, 1])
        gap = s[0] - lead(joint) * angle
        trans[0] = gap - lead(joint) * 2 * np.pi * np.round(gap / joint.pitch) if joint.pitch else gap
    turns = [d - 3 for d in kind.free if d >= 3]
    if not turns:
        return np.r_[trans, R[2, 1], R[0, 2], R[1, 0]]
    if len(turns) == 3:
        return np.array(trans)
    (k,) = turns  # both sides share the axis e_k; the rates of this axis, omega x e_k, are the other two turns
    a, b = (k + 1) % 3, (k + 2) % 3
    across = {a: -R[b, k], b: R[a, k]}
    return np.r_[trans, across[min(a, b)], across[max(a, b)]]


def joint_transform(joint, q) -> tuple[np.ndarray, np.ndarray]:
    """R(q) and s(q) of a joint (notation, "Joints and frames")."""
    q, kind = np.atleast_1d(np.asarray(q, float)), of(joint.type)
    R, s = np.eye(3), np.zeros(3)
    for x, d in zip(q[: kind.scalars], kind.free, strict=False):
        if d < 3:
            s[d] = x
        else:
            R = R @ rotation_about(d - 3, x)
    if kind.lead:
        s[0] = lead(joint) * q[0]
    return (matrix_from_quaternion(q[kind.scalars :]) if kind.ball else R), s


def joint_rates(joint, R: np.ndarray, qd) -> tuple[np.ndarray, np.ndarray]:
    """Relative angular velocity and sliding velocity in the inboard joint frame."""
    six, kind = np.zeros(6), of(joint.type)
    six[list(kind.free)] = np.atleast_1d(np.asarray(qd, float))
    if kind.crossed:
        return six[3] * np.array([1.0, 0.0, 0.0]) + six[4] * R[:, 1], six[:3]
    if kind.lead:
        six[0] = lead(joint) * six[3]
    return six[3:], six[:3]


def joint_coordinates(joint, R: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Coordinates of a joint from the poses: angles by atan2; the angle of a screw is continued by its travel."""
    kind = of(joint.type)
    if kind.crossed:
        return np.array([np.arctan2(R[2, 1], R[1, 1]), np.arctan2(R[0, 2], R[0, 0])])
    q = []
    for d in kind.free[: kind.scalars]:
        a, b = (d + 1) % 3, (d + 2) % 3
        q.append(s[d] if d < 3 else np.arctan2(R[b, a], R[a, a]))
    if kind.lead and joint.pitch:
        q[0] += 2 * np.pi * np.round((s[0] / lead(joint) - q[0]) / (2 * np.pi))
    return np.r_[q, quaternion_from_matrix(R)] if kind.ball else np.array(q)
