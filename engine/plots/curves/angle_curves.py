"""Angles as curves, in degrees within ±180. A curve has gaps where the angle wraps, and where the contact jumps or is open."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def wrapped(angle: np.ndarray) -> np.ndarray:
    """The angle within (−π, π]."""
    out = np.remainder(angle + np.pi, 2 * np.pi) - np.pi
    return np.where(out == -np.pi, np.pi, out)


def broken(time: np.ndarray, angle: np.ndarray, jumps: Sequence[float] = ()) -> tuple[np.ndarray, np.ndarray]:
    """(time, degrees) of an angle (rad), as a curve that does not join unrelated points.

    Where two rows differ by more than half a turn, the curve leaves at ±180°, has a gap (NaN), and enters at ∓180°. At the times
    ``jumps`` (reversals, separations) the curve has a gap, because a line would show values that never occurred.
    """
    w = wrapped(np.asarray(angle, float))
    t = np.asarray(time, float)
    if len(t) < 2:
        return t, np.degrees(w)
    gaps = dict.fromkeys(np.flatnonzero(np.abs(np.diff(w)) > np.pi).tolist(), True)
    gaps |= dict.fromkeys((np.searchsorted(t, jumps, side="right") - 1).tolist(), False)
    pieces, first = [], 0
    for i in sorted(i for i in gaps if 0 <= i < len(t) - 1):
        pieces += [np.array([t[first : i + 1], w[first : i + 1]]), _gap(t, w, i, gaps[i])]
        first = i + 1
    times, angles = np.concatenate([*pieces, np.array([t[first:], w[first:]])], axis=1)
    return times, np.degrees(angles)


def _gap(t: np.ndarray, w: np.ndarray, i: int, wraps: bool) -> np.ndarray:
    """Points (times, angles) of a gap between the rows i and i + 1. The gap is a NaN; if the angle wraps, the points ±π and ∓π at
    the time of the crossing enclose the NaN."""
    if not wraps:
        return np.array([[t[i]], [np.nan]])
    edge = np.copysign(np.pi, w[i])
    rest, total = edge - w[i], 2 * np.pi - abs(w[i + 1] - w[i])
    at = t[i] + (t[i + 1] - t[i]) * (abs(rest) / total if total > 0 else 0.5)
    return np.array([[at] * 3, [edge, np.nan, -edge]])


def rotation_vector(q: np.ndarray) -> np.ndarray:
    """Rotation vectors (n×3, rad) of unit quaternions (n×4, scalar first), continuous from row to row."""
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    signs = np.cumprod(np.where(np.einsum("ij,ij->i", q[1:], q[:-1]) < 0, -1.0, 1.0))
    q = q * np.concatenate([[1.0], signs])[:, None]
    if len(q) and q[0, 0] < 0:
        q = -q
    size = np.linalg.norm(q[:, 1:], axis=1)
    angle = 2 * np.arctan2(size, q[:, 0])
    return q[:, 1:] * np.where(size > 1e-12, angle / np.maximum(size, 1e-300), 2.0)[:, None]
