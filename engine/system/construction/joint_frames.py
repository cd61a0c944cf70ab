"""Joint frames from axes and references (notation, "Joints and frames"). Named axes give exact zeros and ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Direction = str | Sequence[float]


NAMES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def direction(d: Direction) -> np.ndarray:
    """Unit vector (3) of a named or numeric direction."""
    if isinstance(d, str):
        v = np.array(NAMES[d.lstrip("-")])
        return np.where(v == 0.0, 0.0, -v) if d.startswith("-") else v
    v = np.array(d, float)
    if np.count_nonzero(v) == 1:
        return np.where(v == 0.0, 0.0, np.sign(v))
    return v / np.linalg.norm(v)


def frame(axis: Direction | None, reference: Direction | None) -> tuple[float, ...]:
    """The joint frame, a 3×3 matrix as a row-major tuple (9). The columns are e1 (along ``axis``), e2 (towards ``reference``) and
    e3."""
    if axis is None:
        return IDENTITY
    e1 = direction(axis)
    ref = direction(reference) if reference is not None else np.eye(3)[(int(np.argmax(np.abs(e1))) + 1) % 3]
    e2 = _perpendicular(e1, ref)
    (x1, y1, z1), (x2, y2, z2) = e1.tolist(), e2.tolist()
    e3 = y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2
    return tuple(x + 0.0 for row in zip((x1, y1, z1), (x2, y2, z2), e3, strict=True) for x in row)


def _perpendicular(e1: np.ndarray, ref: np.ndarray) -> np.ndarray:
    along = float(e1 @ ref)
    if along == 0.0:
        return ref
    e2 = ref - along * e1
    return direction(tuple(float(x) for x in e2))


def matrix(f: Sequence[float]) -> np.ndarray:
    """The 3×3 array of a row-major tuple (9)."""
    return np.array(f, float).reshape(3, 3)
