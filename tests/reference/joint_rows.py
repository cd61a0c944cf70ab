"""Six directions of relative motion per joint: which are free, which constrained, with their rows and rates of change.

Directions 0..2: translation of the outboard point seen from the inboard part, along e1, e2, e3 of the inboard frame.
Directions 3..5: relative rotation about the same axes; universal joint: about u1, u2, u1 x u2.
A direction is a force F at the outboard point and a torque T, on the outboard part, opposite on the inboard part; its
rate is the power of that pair at unit size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .rotation import cross, matrix_from_quaternion, quaternion_from_matrix, rotation_about

FREE_DIRECTIONS = {
    "fixed": (),
    "revolute": (3,),
    "prismatic": (0,),
    "cylindrical": (0, 3),
    "screw": (3,),
    "universal": (3, 4),
    "spherical": (3, 4, 5),
    "planar": (1, 2, 3),
    "free": (0, 1, 2, 3, 4, 5),
}
SCALAR_COORDINATES = {"spherical": 0, "free": 3}
"""Coordinates before the quaternion of the types that have one."""


@dataclass(frozen=True)
class Directions:
    """F, T (k x 3, world), rate (k) and bias (k): d(rate)/dt = rows times accelerations + bias."""

    F: np.ndarray
    T: np.ndarray
    rate: np.ndarray
    bias: np.ndarray

    def pick(self, P: np.ndarray) -> Directions:
        """Linear combinations P (n x 6) of the six directions."""
        return Directions(P @ self.F, P @ self.T, P @ self.rate, P @ self.bias)


def freedoms(kind: str) -> int:
    """Number of rates of a joint type."""
    return len(FREE_DIRECTIONS[kind])


def lead(joint) -> float:
    """Travel per angle of a screw."""
    return joint.pitch / (2 * np.pi)


def free_picker(joint) -> np.ndarray:
    """Rows that pick the freedoms in the order of the rates."""
    return np.eye(6)[list(FREE_DIRECTIONS[joint.type])].reshape(-1, 6)


def constraint_picker(joint) -> np.ndarray:
    """Rows that pick the constrained directions; a screw ties its travel to its angle."""
    rows = np.eye(6)[[k for k in range(6) if k not in FREE_DIRECTIONS[joint.type]]].reshape(-1, 6)
    if joint.type == "screw":
        rows[0, 3] = -lead(joint)
    return rows


def directions(state, name: str) -> Directions:
    """The six directions of joint ``name`` with rates and biases, by hand differentiation of the relative motion."""
    j = state.joint_pose(name)
    wi, wo = state.omega[j.inboard], state.omega[j.outboard]
    rho_i, rho_o = j.p_out - state.c[j.inboard], j.p_out - state.c[j.outboard]
    slide = state.v[j.outboard] + cross(wo, rho_o) - state.v[j.inboard] - cross(wi, rho_i)
    centripetal = cross(wo, cross(wo, rho_o)) - cross(wi, cross(wi, rho_i)) - 2 * cross(wi, slide)
    turn = wo - wi
    if state.scene.joints[name].type == "universal":
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


def position_residual(joint, R: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Constraint functions whose rates are the constrained directions (at a closed state), in their order.

    R takes outboard to inboard joint components, s is the travel in inboard components.
    """
    if joint.type == "universal":
        return np.r_[s, -R[0, 1]]
    trans = [s[k] for k in range(3) if k not in FREE_DIRECTIONS[joint.type]]
    if joint.type == "screw":
        angle = np.arctan2(R[2, 1], R[1, 1])
        gap = s[0] - lead(joint) * angle
        trans[0] = gap - lead(joint) * 2 * np.pi * np.round(gap / joint.pitch) if joint.pitch else gap
    if joint.type in ("fixed", "prismatic"):
        return np.r_[trans, R[2, 1], R[0, 2], R[1, 0]]
    if joint.type in ("spherical", "free"):
        return np.array(trans)
    return np.r_[trans, -R[2, 0], R[1, 0]]


def joint_transform(joint, q) -> tuple[np.ndarray, np.ndarray]:
    """R(q) and s(q) of NOTATION.md."""
    q = np.atleast_1d(np.asarray(q, float))
    kind, s = joint.type, np.zeros(3)
    if kind in ("revolute", "screw"):
        s[0] = lead(joint) * q[0] if kind == "screw" else 0.0
        return rotation_about(0, q[0]), s
    if kind == "prismatic":
        return np.eye(3), np.array([q[0], 0.0, 0.0])
    if kind == "cylindrical":
        return rotation_about(0, q[1]), np.array([q[0], 0.0, 0.0])
    if kind == "universal":
        return rotation_about(0, q[0]) @ rotation_about(1, q[1]), s
    if kind == "planar":
        return rotation_about(0, q[2]), np.array([0.0, q[0], q[1]])
    if kind == "spherical":
        return matrix_from_quaternion(q), s
    if kind == "free":
        return matrix_from_quaternion(q[3:]), q[:3].copy()
    return np.eye(3), s


def joint_rates(joint, R: np.ndarray, qd) -> tuple[np.ndarray, np.ndarray]:
    """Relative angular velocity and sliding velocity in the inboard joint frame."""
    six = np.zeros(6)
    six[list(FREE_DIRECTIONS[joint.type])] = np.atleast_1d(np.asarray(qd, float))
    if joint.type == "universal":
        return six[3] * np.array([1.0, 0.0, 0.0]) + six[4] * R[:, 1], six[:3]
    if joint.type == "screw":
        six[0] = lead(joint) * six[3]
    return six[3:], six[:3]


def joint_coordinates(joint, R: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Coordinates of a joint from the poses: angles by atan2, a screw continued through its travel."""
    kind = joint.type
    angle = np.arctan2(R[2, 1], R[1, 1])
    if kind == "screw" and joint.pitch:
        angle += 2 * np.pi * np.round((s[0] / lead(joint) - angle) / (2 * np.pi))
    if kind in ("revolute", "screw"):
        return np.array([angle])
    if kind == "prismatic":
        return s[:1].copy()
    if kind == "cylindrical":
        return np.array([s[0], angle])
    if kind == "universal":
        return np.array([angle, np.arctan2(R[0, 2], R[0, 0])])
    if kind == "planar":
        return np.array([s[1], s[2], angle])
    if kind == "spherical":
        return quaternion_from_matrix(R)
    if kind == "free":
        return np.r_[s, quaternion_from_matrix(R)]
    return np.zeros(0)
