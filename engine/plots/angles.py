"""Angles as curves: degrees within ±180, broken where they wrap and where a contact really jumps or is open."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def wrapped(angle: np.ndarray) -> np.ndarray:
    """The angle within (−π, π]."""
    out = np.remainder(angle + np.pi, 2 * np.pi) - np.pi
    return np.where(out == -np.pi, np.pi, out)


def broken(time: np.ndarray, angle: np.ndarray, jumps: Sequence[float] = ()) -> tuple[np.ndarray, np.ndarray]:
    """(time, degrees) of an angle (rad) as a curve without false vertical lines.

    Between two rows more than half a turn apart the curve leaves at ±180° and enters again at ∓180°, with a gap (NaN)
    between; at the times ``jumps`` (reversals, separations) there is a gap too: the jump is real, a slanted line would
    not be.
    """
    w = wrapped(np.asarray(angle, float))
    t = np.asarray(time, float)
    if len(t) < 2:
        return t, np.degrees(w)
    turns = np.diff(w)
    wraps = np.flatnonzero(np.abs(turns) > np.pi)
    cut = {int(i): "wrap" for i in wraps}
    for jump in jumps:
        i = int(np.searchsorted(t, jump, side="right")) - 1
        if 0 <= i < len(t) - 1:
            cut[i] = "jump"
    pieces_t, pieces_w, first = [], [], 0
    for i in sorted(cut):
        pieces_t += [t[first : i + 1], *_gap(t, w, i, cut[i] == "wrap")[0]]
        pieces_w += [w[first : i + 1], *_gap(t, w, i, cut[i] == "wrap")[1]]
        first = i + 1
    return np.concatenate([*pieces_t, t[first:]]), np.degrees(np.concatenate([*pieces_w, w[first:]]))


def _gap(t: np.ndarray, w: np.ndarray, i: int, wrap: bool) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Points to put between rows i and i + 1: a gap (NaN); for a wrap also the crossings of ±π on both sides of it."""
    if not wrap:
        return [t[i : i + 1]], [np.array([np.nan])]
    edge = np.copysign(np.pi, w[i])
    rest, total = edge - w[i], 2 * np.pi - abs(w[i + 1] - w[i])
    at = t[i] + (t[i + 1] - t[i]) * (abs(rest) / total if total > 0 else 0.5)
    return [np.full(3, at)], [np.array([edge, np.nan, -edge])]


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
