"""Rotations: the formulas that the reference needs, independent of the engine."""

from __future__ import annotations

import numpy as np

E3 = np.eye(3)


def cross(a, b) -> np.ndarray:
    """a x b of two 3-vectors (several times faster than numpy's general function)."""
    ax, ay, az = a
    bx, by, bz = b
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def skew(a) -> np.ndarray:
    """The matrix that takes b to a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def rotation_about(k: int, angle: float) -> np.ndarray:
    """3x3 rotation by ``angle`` about coordinate axis ``k`` (0, 1, 2)."""
    a, b = (k + 1) % 3, (k + 2) % 3
    out = np.zeros((3, 3))
    out[k, k] = 1.0
    out[a, a] = out[b, b] = np.cos(angle)
    out[b, a] = np.sin(angle)
    out[a, b] = -np.sin(angle)
    return out


def matrix_from_quaternion(q) -> np.ndarray:
    """Rotation matrix of a scalar-first quaternion of any length."""
    w, *v = np.asarray(q, float) / np.linalg.norm(q)
    v = np.array(v)
    return (w * w - v @ v) * E3 + 2 * np.outer(v, v) + 2 * w * skew(v)


def quaternion_from_matrix(R: np.ndarray) -> np.ndarray:
    """Unit quaternion, scalar first and not negative, as the top eigenvector of the 4x4 form of Bar-Itzhack."""
    K = np.empty((4, 4))
    K[0, 0] = np.trace(R)
    K[0, 1:] = K[1:, 0] = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    K[1:, 1:] = R + R.T - np.trace(R) * E3
    q = np.linalg.eigh(K / 3.0)[1][:, -1]
    return -q if q[0] < 0 else q


def turned(R: np.ndarray, vector) -> np.ndarray:
    """R after a turn by the world rotation vector ``vector`` (Rodrigues)."""
    angle = np.linalg.norm(vector)
    if angle == 0.0:
        return R.copy()
    axis = np.asarray(vector) / angle
    K = skew(axis)
    return (E3 + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K) @ R


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """A random rotation with uniform distribution."""
    return matrix_from_quaternion(rng.normal(size=4))
