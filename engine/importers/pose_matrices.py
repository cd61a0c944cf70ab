"""Poses as homogeneous 4×4 matrices, and rotations as 3×3 matrices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Pose = np.ndarray
"""4×4 matrix that maps coordinates in the placed frame to coordinates in the outer frame."""


def pose(place: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0), rotation: np.ndarray | None = None) -> Pose:
    """A pose from a position (3), m, and a rotation (3×3)."""
    out = np.eye(4)
    out[:3, 3] = place
    if rotation is not None:
        out[:3, :3] = rotation
    return out


def inverse(p: Pose) -> Pose:
    """The inverse pose."""
    return pose(-p[:3, :3].T @ p[:3, 3], p[:3, :3].T)


def about(axis: Sequence[float] | np.ndarray, angle: float) -> np.ndarray:
    """The rotation (3×3) by an angle, rad, about an axis of any nonzero norm."""
    a = np.asarray(axis, float)
    a = a / np.linalg.norm(a)
    K = np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """The rotation by roll about x, then pitch about y, then yaw about z (fixed axes)."""
    x, y, z = np.eye(3)
    return about(z, yaw) @ about(y, pitch) @ about(x, roll)


def roll_pitch_yaw(R: np.ndarray) -> tuple[float, float, float]:
    """The angles (roll, pitch, yaw) for which ``rpy`` gives a rotation (3×3). Roll is computed after yaw. Therefore the sum of roll
    and yaw is exact where their axes are parallel."""
    yaw = float(np.arctan2(R[1, 0], R[0, 0]))
    pitch = float(np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])))
    rest = about([0.0, 0.0, 1.0], -yaw) @ R
    return float(np.arctan2(-rest[1, 2], rest[1, 1])), pitch, yaw


def of_quaternion(q: Sequence[float] | np.ndarray) -> np.ndarray:
    """The rotation (3×3) of a quaternion, scalar first, of any nonzero norm."""
    w, x, y, z = np.asarray(q, float) / np.linalg.norm(q)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def to_quaternion(R: np.ndarray) -> list[float]:
    """The unit quaternion of a rotation (3×3). The scalar is first and not negative."""
    d = np.diag(R)
    four = np.array([1 + d.sum(), *(1 + 2 * d - d.sum())])
    k = int(np.argmax(four))
    w = [four[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    x = [w[1], four[1], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]]
    y = [w[2], x[2], four[2], R[1, 2] + R[2, 1]]
    q = np.array([w, x, y, [w[3], x[3], y[3], four[3]]][k])
    q /= np.linalg.norm(q)
    return [float(c) + 0.0 for c in (q if q[0] >= 0 else -q)]


def along(axis: Sequence[float] | np.ndarray, place: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0)) -> Pose:
    """The pose of a joint's frame. e1 is along a vector of any nonzero norm. e2 is any direction normal to e1."""
    e1 = np.asarray(axis, float)
    e1 = e1 / np.linalg.norm(e1)
    e2 = np.cross(e1, np.eye(3)[int(np.argmin(np.abs(e1)))])
    e2 /= np.linalg.norm(e2)
    return pose(place, np.column_stack([e1, e2, np.cross(e1, e2)]))


def least_turn(goal: Sequence[float] | np.ndarray) -> np.ndarray:
    """The smallest rotation (3×3) from z to a direction of any nonzero norm."""
    z = np.asarray(goal, float) / np.linalg.norm(goal)
    across = np.cross([0.0, 0.0, 1.0], z)
    sine = float(np.linalg.norm(across))
    if sine < 1e-12:
        return np.eye(3) if z[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return about(across, float(np.arctan2(sine, z[2])))
