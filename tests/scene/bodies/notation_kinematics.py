"""Forward kinematics, written directly from notation.md ("Joints and frames"). It gives the poses of all bodies at the start and
the gaps of the loops."""

from __future__ import annotations

import numpy as np

from trunnion.scene.data_classes.scene import AxisAngle, Joint, Scene, Side

NAMED = {"x": np.eye(3)[0], "y": np.eye(3)[1], "z": np.eye(3)[2]}


def rot(k: int, angle: float) -> np.ndarray:
    """Rotation matrix for an angle (rad) about axis k."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (k + 1) % 3, (k + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[j, i], R[i, j] = s, -s
    return R


def turned(w: np.ndarray) -> np.ndarray:
    """Rotation by a vector (Rodrigues)."""
    a = np.linalg.norm(w)
    if a == 0:
        return np.eye(3)
    x, y, z = w / a
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K


def vector(d) -> np.ndarray:
    """Components (3) of a direction given as an axis name or a vector."""
    return (-1 if d[0] == "-" else 1) * NAMED[d[-1]] if isinstance(d, str) else np.array(d, float)


def frame(axis, reference) -> np.ndarray:
    """e1, e2, e3 as columns."""
    if axis is None:
        return np.eye(3)
    e1 = vector(axis) / np.linalg.norm(vector(axis))
    e2 = np.eye(3)[(int(np.argmax(np.abs(e1))) + 1) % 3] if reference is None else vector(reference)
    e2 = e2 - (e2 @ e1) * e1
    e2 /= np.linalg.norm(e2)
    return np.column_stack([e1, e2, np.cross(e1, e2)])


def motion(j: Joint, q: np.ndarray, qd: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """(R, s): rotation and translation of the joint after a time t at the start rates; notation, "Joints and frames"."""
    q = q + t * qd if len(q) == len(qd) else q
    match j.type:
        case "revolute":
            return rot(0, q[0]), np.zeros(3)
        case "prismatic":
            return np.eye(3), np.array([q[0], 0, 0])
        case "cylindrical":
            return rot(0, q[1]), np.array([q[0], 0, 0])
        case "universal":
            return rot(0, q[0]) @ rot(1, q[1]), np.zeros(3)
        case "fixed":
            return np.eye(3), np.zeros(3)
        case "spherical":
            w, *v = q / np.linalg.norm(q)
            v = np.array(v)
            R = turned(2 * np.arctan2(np.linalg.norm(v), w) * v / (np.linalg.norm(v) or 1))
            return turned(t * qd) @ R, np.zeros(3)
        case "free":
            w, *v = q[3:] / np.linalg.norm(q[3:])
            v = np.array(v)
            R = turned(2 * np.arctan2(np.linalg.norm(v), w) * v / (np.linalg.norm(v) or 1))
            return turned(t * qd[3:]) @ R, q[:3] + t * qd[:3]
    raise NotImplementedError(j.type)


def start(j: Joint) -> tuple[np.ndarray, np.ndarray] | None:
    """Start coordinates and rates of a joint. A drive gives the values that it prescribes. None if the scene gives no values."""
    if j.drive is not None:
        return np.array([j.drive.constant.start]), np.array([j.drive.constant.rate])
    if j.type == "fixed":
        return np.zeros(0), np.zeros(0)
    if j.start is None:
        return None
    assert not isinstance(j.start.q, AxisAngle)
    return np.atleast_1d(np.array(j.start.q, float)), np.atleast_1d(np.array(j.start.qd, float))


class Poses:
    """Orientation R and origin r of every body. Every joint has moved at its start rates for a time t, or all coordinates are
    ``q``."""

    def __init__(self, scene: Scene, t: float = 0.0, q: float | None = None):
        self.scene = scene
        self.R, self.r = {"ground": np.eye(3)}, {"ground": np.zeros(3)}
        waiting = {n: j for n, j in scene.joints.items() if start(j) is not None}
        while waiting:
            name = next(n for n, j in waiting.items() if self.side(j, j.inboard)[0] in self.R)
            j = waiting.pop(name)
            (a, p, A), (b, o, B) = self.side(j, j.inboard), self.side(j, j.outboard)
            coordinates, rates = start(j)
            R, s = motion(j, coordinates if q is None else 0 * coordinates + q, rates, t)
            W = self.R[a] @ A
            self.R[b] = W @ R @ B.T
            self.r[b] = self.r[a] + self.R[a] @ p + W @ s - self.R[b] @ o

    def side(self, j: Joint, side: str | Side) -> tuple[str, np.ndarray, np.ndarray]:
        """Body, point and frame of one side, in the body's frame."""
        if isinstance(side, str):
            body, _, name = side.partition(".")
            return body, self.local(body, name or (0, 0, 0)), frame(j.axis, j.reference)
        axis = j.axis if side.axis is None else side.axis
        return side.body, self.local(side.body, side.point), frame(axis, side.reference or j.reference)

    def local(self, body: str, point) -> np.ndarray:
        """A point in the body's frame."""
        if isinstance(point, str):
            point = (self.scene.ground if body == "ground" else self.scene.bodies[body]).points[point]
        return np.array(point, float)

    def point(self, body: str, point) -> np.ndarray:
        """A point in the world."""
        return self.r[body] + self.R[body] @ self.local(body, point)

    def column(self, name: str) -> float:
        """<body>.position[k] or <body>.<point>.position[k]."""
        body, *point, last = name.split(".")
        k = int(last.removeprefix("position[").removesuffix("]")) - 1
        return float(self.point(body, point[0] if point else self.scene.bodies[body].center)[k])


def gaps(poses: Poses) -> dict[str, np.ndarray]:
    """Gaps of every joint without start values: the offset of its points (for a rod, the error of its length), and for a revolute
    also the tilt of the axes."""
    out = {}
    for name, j in poses.scene.joints.items():
        if start(j) is not None:
            continue
        (a, p, A), (b, o, B) = poses.side(j, j.inboard), poses.side(j, j.outboard)
        gap = poses.r[a] + poses.R[a] @ p - poses.r[b] - poses.R[b] @ o
        if j.type == "rod":
            gap = np.array([np.linalg.norm(gap) - j.length])
        if j.type == "revolute":
            gap = np.concatenate([gap, np.cross(poses.R[a] @ A[:, 0], poses.R[b] @ B[:, 0])])
        out[name] = gap
    return out
