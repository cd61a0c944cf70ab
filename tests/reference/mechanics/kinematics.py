"""Forward kinematics along a spanning tree, which may pass every joint in either direction, and the closure of the loop joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import GROUND, Frames, Part, joint_frames, parts
from tests.reference.mechanics.joint_constraints import (
    constraint_picker,
    directions,
    free_picker,
    freedoms,
    joint_coordinates,
    joint_rates,
    joint_transform,
    of,
    position_residual,
)
from tests.reference.mechanics.rotation import cross

NOTHING = Part(0.0, np.zeros(3), np.zeros((3, 3)))


@dataclass(frozen=True)
class JointPose:
    """Points and frames of both sides of a joint in the world."""

    inboard: str
    p_in: np.ndarray
    A_in: np.ndarray
    outboard: str
    p_out: np.ndarray
    A_out: np.ndarray

    @property
    def R(self) -> np.ndarray:
        """Matrix that takes components in the outboard joint frame to the inboard joint frame (3 x 3)."""
        return self.A_in.T @ self.A_out

    @property
    def s(self) -> np.ndarray:
        """The travel p_out - p_in in the inboard joint frame."""
        return self.A_in.T @ (self.p_out - self.p_in)


@dataclass
class State:
    """Poses and velocities of all bodies (world): R, origin r, mass centre c, its velocity v, angular velocity omega.

    ``q``, ``qd``: coordinates and rates of every joint; those of ``walked`` joints are given, those of ``loops`` are computed from
    the poses.
    """

    scene: object
    t: float
    parts: dict[str, Part]
    frames: dict[str, Frames]
    R: dict[str, np.ndarray] = field(default_factory=dict)
    r: dict[str, np.ndarray] = field(default_factory=dict)
    c: dict[str, np.ndarray] = field(default_factory=dict)
    v: dict[str, np.ndarray] = field(default_factory=dict)
    omega: dict[str, np.ndarray] = field(default_factory=dict)
    q: dict[str, np.ndarray] = field(default_factory=dict)
    qd: dict[str, np.ndarray] = field(default_factory=dict)
    walked: tuple[str, ...] = ()
    loops: tuple[str, ...] = ()

    def part(self, body: str) -> Part:
        """Mass properties of a body; the ground has none."""
        return self.parts.get(body, NOTHING)

    def put(self, body: str, R, r, v_r, omega) -> None:
        """Place a body: orientation, origin, velocity of the origin, angular velocity."""
        arm = R @ self.part(body).center
        self.R[body], self.r[body], self.c[body] = R, r, r + arm
        self.v[body], self.omega[body] = v_r + cross(omega, arm), omega

    def point(self, body: str, local) -> tuple[np.ndarray, np.ndarray]:
        """World position and velocity of a point given in the body's frame."""
        p = self.r[body] + self.R[body] @ np.asarray(local, float)
        return p, self.v[body] + cross(self.omega[body], p - self.c[body])

    def joint_pose(self, name: str) -> JointPose:
        """Points and frames of a joint in the world."""
        f = self.frames[name]
        Ri, Ro = self.R[f.inboard], self.R[f.outboard]
        p_in, p_out = self.r[f.inboard] + Ri @ f.p_in, self.r[f.outboard] + Ro @ f.p_out
        return JointPose(f.inboard, p_in, Ri @ f.F_in, f.outboard, p_out, Ro @ f.F_out)


def empty_state(scene, t: float = 0.0) -> State:
    """A state with only the ground placed."""
    state = State(scene, t, parts(scene), {n: joint_frames(scene, j) for n, j in scene.joints.items()})
    state.put(GROUND, np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    return state


def forward(scene, q: Mapping, qd: Mapping | None = None, t: float = 0.0) -> State:
    """State of all bodies from coordinates of a spanning tree of joints (fixed joints are included automatically). Joints are
    traversed from the ground in either direction, in the scene's order. A joint between two placed bodies is a loop joint. Its q
    and qd follow from the poses (with the number of turns nearest to a given q)."""
    qd = qd or {}
    state = empty_state(scene, t)
    carrying = {n: j for n, j in scene.joints.items() if not of(j.type).line}
    listed = [n for n in carrying if n in q]
    fixed = [n for n, j in carrying.items() if not freedoms(j.type) and n not in q]
    while len(state.R) <= len(scene.bodies):
        ready = [n for n in listed + fixed if _one_end(state, n)]
        if not ready:
            raise ValueError(f"bodies not connected with the ground: {sorted(set(scene.bodies) - set(state.R))}")
        _walk(state, ready[0], q.get(ready[0], ()), qd.get(ready[0]))
    state.loops = tuple(n for n in scene.joints if n not in state.walked)
    for name in state.loops:
        state.q[name], state.qd[name] = measured(state, name, q.get(name))
    return state


def measured(state: State, name: str, near=None) -> tuple[np.ndarray, np.ndarray]:
    """q and qd of a joint computed from the poses and velocities of its bodies."""
    joint, pose = state.scene.joints[name], state.joint_pose(name)
    q = joint_coordinates(joint, pose.R, pose.s)
    if near is not None:
        q = _continued(joint, q, np.atleast_1d(np.asarray(near, float)))
    return q, directions(state, name).pick(free_picker(joint)).rate


def closure(state: State, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Constraint residuals of a joint, position and velocity, in the order of its rows."""
    joint, pose = state.scene.joints[name], state.joint_pose(name)
    rows = directions(state, name).pick(constraint_picker(joint))
    return position_residual(joint, pose.R, pose.s), rows.rate


def _one_end(state: State, name: str) -> bool:
    f = state.frames[name]
    return (f.inboard in state.R) != (f.outboard in state.R)


def _walk(state: State, name: str, q, qd) -> None:
    """Place the second body of a joint; A_out = A_in R(q), p_out = p_in + A_in s (notation, "Joints and frames")."""
    joint, f = state.scene.joints[name], state.frames[name]
    q = np.atleast_1d(np.asarray(q, float))
    qd = np.zeros(freedoms(joint.type)) if qd is None else np.atleast_1d(np.asarray(qd, float))
    R, s = joint_transform(joint, q)
    turn, slide = joint_rates(joint, R, qd)
    if f.inboard in state.R:
        p, v = state.point(f.inboard, f.p_in)
        A = state.R[f.inboard] @ f.F_in
        w = state.omega[f.inboard]
        Rb, omega = A @ R @ f.F_out.T, w + A @ turn
        v_p = v + cross(w, A @ s) + A @ slide
        body, p_b, arm = f.outboard, p + A @ s, Rb @ f.p_out
    else:
        p, v = state.point(f.outboard, f.p_out)
        A = state.R[f.outboard] @ f.F_out @ R.T
        Rb, omega = A @ f.F_in.T, state.omega[f.outboard] - A @ turn
        v_p = v - cross(omega, A @ s) - A @ slide
        body, p_b, arm = f.inboard, p - A @ s, Rb @ f.p_in
    state.put(body, Rb, p_b - arm, v_p - cross(omega, arm), omega)
    state.q[name], state.qd[name] = q, qd
    state.walked += (name,)


def _continued(joint, q: np.ndarray, near: np.ndarray) -> np.ndarray:
    """q shifted by whole turns (or the quaternion's sign) to lie nearest to ``near``."""
    q = q.copy()
    kind = of(joint.type)
    if kind.ball:
        k = kind.scalars
        q[k:] *= -1.0 if q[k:] @ near[k:] < 0 else 1.0
        return q
    angles = [i for i, d in enumerate(kind.free) if d >= 3 and not kind.lead]
    q[angles] += 2 * np.pi * np.round((near[angles] - q[angles]) / (2 * np.pi))
    return q
