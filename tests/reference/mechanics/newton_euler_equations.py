"""Absolute Newton-Euler equations of all bodies with every joint's constraint rows, solved as functions of friction.

Unknown accelerations u' = [a_c, alpha] of each body, multipliers lam of all constraint rows and of the driven freedoms:
    M u' - J^T lam = f + B eta,   J u' = gamma.
eta: friction on the *inboard* part along the freedoms of the joints with friction. Every quantity is kept as an array
with 1 + n_eta columns: its value at eta = 0 and its slopes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.reference.mechanics.joint_constraints import Directions, constraint_picker, directions, free_picker
from tests.reference.mechanics.kinematics import State
from tests.reference.mechanics.loads_and_devices import Applied, scalar_freedoms
from tests.reference.mechanics.rotation import cross
from tests.reference.mechanics.time_signals import drive_motion, per_freedom

RANK_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Row:
    """One row of J: its joint, its kind ("constraint" or "drive"), its number in this kind, its coefficients, and its required
    acceleration gamma."""

    joint: str
    role: str
    k: int
    F: np.ndarray
    T: np.ndarray
    gamma: float


def motion_row(state: State, name: str, F, T, index: dict[str, int]) -> np.ndarray:
    """The rate of a direction (F, T) of a joint as a row over the velocities [v_c, omega] of all bodies."""
    pose, row = state.joint_pose(name), np.zeros(6 * len(index))
    for body, sign in ((pose.outboard, 1.0), (pose.inboard, -1.0)):
        if body in index:
            arm = pose.p_out - state.c[body]
            at = 6 * index[body]
            row[at : at + 6] += sign * np.r_[F, cross(arm, F) + T]
    return row


def mass_matrix(state: State) -> np.ndarray:
    """Block diagonal: mass and world inertia about the mass centre of each body."""
    M = np.zeros((6 * len(state.parts),) * 2)
    for i, (body, part) in enumerate(state.parts.items()):
        R, at = state.R[body], 6 * i
        M[at : at + 3, at : at + 3] = part.mass * np.eye(3)
        M[at + 3 : at + 6, at + 3 : at + 6] = R @ part.inertia @ R.T
    return M


def rows_of(state: State, name: str) -> list[Row]:
    """Constraint rows of a joint and the rows of its driven freedoms, with their accelerations."""
    joint, six = state.scene.joints[name], directions(state, name)
    held = six.pick(constraint_picker(joint))
    out = [Row(name, "constraint", k, held.F[k], held.T[k], -held.bias[k]) for k in range(len(held.rate))]
    free = six.pick(free_picker(joint))
    for k, drive in enumerate(per_freedom(joint.drive, len(free.rate))):
        if drive is not None:
            if k >= scalar_freedoms(joint):
                raise ValueError(f"{name}: a freedom of a quaternion cannot be driven")
            out.append(Row(name, "drive", k, free.F[k], free.T[k], drive_motion(drive, state.t)[2] - free.bias[k]))
    return out


def typical_length(state: State) -> float:
    """Root mean square of the arms of joints and of the radii of gyration; it makes ranks and norms independent of units."""
    squares = [np.trace(p.inertia) / p.mass for p in state.parts.values() if p.mass > 0 and np.trace(p.inertia) > 0]
    for name in state.scene.joints:
        pose = state.joint_pose(name)
        for body, p in ((pose.inboard, pose.p_in), (pose.outboard, pose.p_out)):
            if body in state.parts:
                squares.append(float(np.sum((p - state.c[body]) ** 2)))
    squares = [x for x in squares if x > 1e-24]
    return float(np.sqrt(np.mean(squares))) if squares else 1.0


class Equations:
    """The assembled system at one state and its solution as affine functions of eta."""

    def __init__(self, state: State):
        self.state, self.index = state, {b: i for i, b in enumerate(state.parts)}
        self.applied = Applied(state)
        joints = state.scene.joints
        self.effort = {n: self.applied.devices(n) for n in joints}
        self.free: dict[str, Directions] = {n: directions(state, n).pick(free_picker(j)) for n, j in joints.items()}
        self.eta = [(n, k) for n, j in joints.items() if j.friction is not None for k in range(len(self.free[n].rate))]
        self.rows = [row for n in joints for row in rows_of(state, n)]
        size = 6 * len(self.index)
        self.J = np.array([motion_row(state, r.joint, r.F, r.T, self.index) for r in self.rows]).reshape(-1, size)
        self.M = mass_matrix(state)
        bias = self._rotors()
        friction = [-motion_row(state, n, self.free[n].F[k], self.free[n].T[k], self.index) for n, k in self.eta]
        self.f = np.column_stack([self.applied.stacked() - bias, *friction])
        self._solve()

    def _rotors(self) -> np.ndarray:
        """Add the inertias of rotors along freedoms to M. Returns the forces by which rotors resist the known part of the
        accelerations."""
        self.spun, bias = {}, np.zeros(6 * len(self.index))
        for n, j in self.state.scene.joints.items():
            free = self.free[n]
            self.spun[n] = [float(a or 0.0) for a in per_freedom(j.rotor_inertia, len(free.rate))]
            for k, a in enumerate(self.spun[n]):
                row = motion_row(self.state, n, free.F[k], free.T[k], self.index)
                self.M += a * np.outer(row, row)
                bias += a * free.bias[k] * row
        return bias

    def _solve(self) -> None:
        """Null-space method on the scaled rows. Multipliers that are not unique have least norm."""
        L = typical_length(self.state)
        col = np.tile([1.0, 1.0, 1.0, 1 / L, 1 / L, 1 / L], len(self.index))
        row = np.array([1.0 if np.any(r.F) else L for r in self.rows])
        gamma = np.zeros((len(self.rows), self.f.shape[1]))
        gamma[:, 0] = [r.gamma for r in self.rows]
        Js = row[:, None] * self.J * col
        U, sv, Vt = np.linalg.svd(Js) if len(row) else (np.zeros((0, 0)), np.zeros(0), np.eye(len(col)))
        self.rank = int(np.sum(sv > RANK_TOLERANCE * max(sv, default=1.0)))
        self.singular_values = sv
        k = self.rank
        self.null, self.redundant = Vt[k:].T, row[:, None] * U[:, k:]
        Ms, fs = col[:, None] * self.M * col, col[:, None] * self.f
        particular = Vt[:k].T @ ((U[:, :k].T @ (row[:, None] * gamma)) / sv[:k, None])
        reduced = self.null.T @ Ms @ self.null
        z = np.linalg.lstsq(reduced, self.null.T @ (fs - Ms @ particular), rcond=1e-13)[0]
        us = particular + self.null @ z
        self.u = col[:, None] * us
        pull = Ms @ us - fs
        self.lam = row[:, None] * (U[:, :k] @ ((Vt[:k] @ pull) / sv[:k, None]))
        first = row * (self.J @ self.u[:, 0] - gamma[:, 0])
        self.inconsistency = float(np.max(np.abs(first), initial=0.0))

    # -- results of a solution; all arrays have 1 + n_eta columns ---------

    def drive_effort(self, name: str) -> dict[int, np.ndarray]:
        """Multipliers of the driven freedoms of a joint: effort on the outboard part."""
        return {r.k: self.lam[i] for i, r in enumerate(self.rows) if r.joint == name and r.role == "drive"}

    def devices(self, name: str) -> np.ndarray:
        """Efforts of all devices along each freedom, including drives, on the outboard part, less the efforts that rotors need."""
        out = np.zeros((len(self.free[name].rate), self.f.shape[1]))
        out[:, 0] = self.effort[name]
        for k, lam in self.drive_effort(name).items():
            out[k] += lam
        return out - np.array(self.spun[name])[:, None] * self.accelerations(name)

    def friction_columns(self, name: str) -> np.ndarray:
        """Friction on the inboard part along each freedom as affine array (a selection of eta)."""
        out = np.zeros((len(self.free[name].rate), self.f.shape[1]))
        for i, (joint, k) in enumerate(self.eta):
            if joint == name:
                out[k, 1 + i] = 1.0
        return out

    def press(self, name: str) -> np.ndarray:
        """Constraint and friction of a joint on the inboard part: [force; torque at the outboard point], world."""
        out = np.zeros((6, self.f.shape[1]))
        for i, r in enumerate(self.rows):
            if r.joint == name and r.role == "constraint":
                out -= np.outer(np.r_[r.F, r.T], self.lam[i])
        return out + self._along(name) @ self.friction_columns(name)

    def total(self, name: str) -> np.ndarray:
        """Total wrench of a joint on the inboard part: [force; torque at the outboard point], world."""
        return self.press(name) - self._along(name) @ self.devices(name)

    def _along(self, name: str) -> np.ndarray:
        return np.hstack([self.free[name].F, self.free[name].T]).T

    def accelerations(self, name: str) -> np.ndarray:
        """qdd of a joint: rates of change of its rates."""
        free, cols = self.free[name], []
        for k in range(len(free.rate)):
            row = motion_row(self.state, name, free.F[k], free.T[k], self.index) @ self.u
            row[0] += free.bias[k]
            cols.append(row)
        return np.array(cols).reshape(-1, self.f.shape[1])

    def loose(self, name: str) -> np.ndarray:
        """Changes of the joint's wrench on the inboard part that redundancy allows: 6 x redundancy, at the outboard point."""
        out = np.zeros((6, self.redundant.shape[1]))
        for i, r in enumerate(self.rows):
            if r.joint == name:
                out -= np.outer(np.r_[r.F, r.T], self.redundant[i])
        return out
