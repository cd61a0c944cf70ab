"""Positions and rates of bodies and joints for many states at once, as arrays: states first, then bodies or joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import GROUND, joint_frames, parts
from tests.reference.mechanics.frictionless_contact_arms import arms

AHEAD, BACK = [1, 2, 0], [2, 0, 1]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b along the last axis."""
    return a[..., AHEAD] * b[..., BACK] - a[..., BACK] * b[..., AHEAD]


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a · b along the last axis."""
    return (a * b).sum(-1)


def times(A: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Matrices times vectors."""
    return (A @ x[..., None])[..., 0]


def back(A: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Transposed matrices times vectors."""
    return (x[..., None, :] @ A)[..., 0, :]


def matrices(q: np.ndarray) -> np.ndarray:
    """Rotation matrices of quaternions (scalar first) of any length."""
    q = q / np.sqrt(dot(q, q))[..., None]
    w, x, y, z = np.moveaxis(q, -1, 0)
    out = np.empty((*q.shape[:-1], 3, 3))
    out[..., 0, 0], out[..., 1, 1], out[..., 2, 2] = 1 - 2 * (y * y + z * z), 1 - 2 * (z * z + x * x), 1 - 2 * (x * x + y * y)
    out[..., 0, 1], out[..., 1, 0] = 2 * (x * y - w * z), 2 * (x * y + w * z)
    out[..., 0, 2], out[..., 2, 0] = 2 * (x * z + w * y), 2 * (x * z - w * y)
    out[..., 1, 2], out[..., 2, 1] = 2 * (y * z - w * x), 2 * (y * z + w * x)
    return out


@dataclass
class Motion:
    """Bodies (the ground last) and joints of many states. R, c, v, w: axes, mass centre, its velocity, angular velocity.
    """

    t: np.ndarray
    R: np.ndarray
    c: np.ndarray
    v: np.ndarray
    w: np.ndarray


@dataclass
class Sides:
    """Attachments of some joints on a first and a second side: bodies, points from their mass centres, and frames at these
    points."""

    one: np.ndarray
    x_one: np.ndarray
    F_one: np.ndarray
    two: np.ndarray
    x_two: np.ndarray
    F_two: np.ndarray

    def pairs(self, m: Motion) -> Pairs:
        """Frames, points and relative rates of both sides."""
        one, two = self.one, self.two
        p, q = m.c[:, one] + times(m.R[:, one], self.x_one), m.c[:, two] + times(m.R[:, two], self.x_two)
        slide = m.v[:, two] + cross(m.w[:, two], q - m.c[:, two]) - m.v[:, one] - cross(m.w[:, one], q - m.c[:, one])
        return Pairs(m.R[:, one] @ self.F_one, m.R[:, two] @ self.F_two, p, q, slide, m.w[:, two] - m.w[:, one])


@dataclass
class Pairs:
    """A, B: frames of the first and second sides; p, q: their points; slide: velocity of q seen from the first body; turn: relative
    angular velocity. All in the world."""

    A: np.ndarray
    B: np.ndarray
    p: np.ndarray
    q: np.ndarray
    slide: np.ndarray
    turn: np.ndarray


class Frames:
    """The constant data of bodies and joints, and the layout of a state: mass centres, quaternions, velocities, angular velocities,
    then the displacements of the couplings' rows, then the energy that friction took."""

    def __init__(self, scene, rolls: int):
        self.parts = parts(scene)
        self.names = [*self.parts, GROUND]
        self.count = len(self.parts)
        self.index = {b: i for i, b in enumerate(self.names)}
        self.center = np.array([*(p.center for p in self.parts.values()), np.zeros(3)])
        self.mass = np.array([p.mass for p in self.parts.values()])
        self.inertia = np.array([p.inertia for p in self.parts.values()]).reshape(-1, 3, 3)
        self.frames = {n: joint_frames(scene, j) for n, j in scene.joints.items()}
        self.arms = arms(scene, self.frames)
        n = self.count
        self.at = {"c": slice(0, 3 * n), "q": slice(3 * n, 7 * n), "v": slice(7 * n, 10 * n), "w": slice(10 * n, 13 * n),
                   "rolled": slice(13 * n, 13 * n + rolls), "taken": 13 * n + rolls}  # fmt: skip
        self.size = 13 * n + rolls + 1

    def bodies(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Mass centres, quaternions, velocities, angular velocities of states (n x size), with the ground."""
        out = []
        for key, width in (("c", 3), ("q", 4), ("v", 3), ("w", 3)):
            given = y[:, self.at[key]].reshape(len(y), -1, width)
            ground = np.zeros((len(y), 1, width))
            ground[..., 0] = 1.0 if key == "q" else 0.0
            out.append(np.concatenate([given, ground], axis=1))
        return tuple(out)

    def motion(self, t: np.ndarray, y: np.ndarray) -> Motion:
        """The motion of all bodies."""
        c, q, v, w = self.bodies(y)
        return Motion(t, matrices(q), c, v, w)

    def sides(self, names: list[str], turned: list[bool] | None = None) -> Sides:
        """Both sides of joints, the inboard side first. In joints of ``turned``, the outboard side is first."""
        out: list[list] = [[], [], [], [], [], []]
        for name, other in zip(names, turned or [False] * len(names), strict=True):
            f = self.frames[name]
            both = [(self.index[f.inboard], f.p_in, f.F_in), (self.index[f.outboard], f.p_out, f.F_out)]
            for k, (body, p, F) in enumerate(both[::-1] if other else both):
                for target, value in zip(out[3 * k : 3 * k + 3], (body, p - self.center[body], F), strict=True):
                    target.append(value)
        shapes = ((-1,), (-1, 3), (-1, 3, 3)) * 2
        return Sides(*(np.array(x, int if len(s) == 1 else float).reshape(s) for x, s in zip(out, shapes, strict=True)))


class Forces:
    """Forces and torques (about the mass centre) on all bodies of many states, and the power that friction takes."""

    def __init__(self, m: Motion):
        self.m, self.force, self.torque = m, np.zeros_like(m.c), np.zeros_like(m.c)
        self.taken = np.zeros(len(m.c))

    def push(self, body: np.ndarray, at: np.ndarray, force: np.ndarray, torque=0.0, sign: float = 1.0) -> None:
        """Add forces and torques to bodies (index of each) at points of the world."""
        torque = cross(at - self.m.c[:, body], force) + torque
        for k, b in enumerate(body):
            self.force[:, b] += sign * force[:, k]
            self.torque[:, b] += sign * torque[:, k]

    def between(self, inner, outer, at, force, torque=0.0) -> None:
        """Add forces and torques to outer bodies at points of the world, and their opposites to inner bodies."""
        self.push(outer, at, force, torque)
        self.push(inner, at, force, torque, -1.0)
