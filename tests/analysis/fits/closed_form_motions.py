"""Mechanisms with motions in closed form, and textbook formulas for fits. This file uses no code of the engine."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import stats

GLIDER: dict[str, Any] = {
    "schema": 1,
    "gravity": [0, 0, 0],
    "bodies": {"cart": {"box": [0.1, 0.1, 0.1], "density": 1000}},
    "joints": {"rail": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "cart", "start": {"q": 0.1, "qd": 0.5}}},
}
"""A body with x = q + qd t, which is linear in q and qd."""
Q, QD, X = "joints.rail.start.q", "joints.rail.start.qd", "rail.q[1]"
TIME = np.linspace(0.0, 2.0, 9)
LINE = np.column_stack([np.ones(9), TIME])


def noisy(seed: int, deviation: float = 0.02, time: np.ndarray = TIME, q: float = 0.1, qd: float = 0.5) -> np.ndarray:
    """Positions of the glider, measured with noise."""
    return q + qd * time + deviation * np.random.default_rng(seed).normal(size=len(time))


def regression(A: np.ndarray, y: np.ndarray, level: float, deviation: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Estimates of b in y = A b + noise, and half widths of their intervals (by Student's t if the deviation of the noise is
    estimated)."""
    b = np.linalg.solve(A.T @ A, A.T @ y)
    r, free = y - A @ b, len(y) - A.shape[1]
    s = np.sqrt(r @ r / free) if deviation is None else deviation
    quantile = stats.t.ppf(0.5 + 0.5 * level, free) if deviation is None else stats.norm.ppf(0.5 + 0.5 * level)
    return b, quantile * s * np.sqrt(np.diag(np.linalg.inv(A.T @ A)))


SLIDER: dict[str, Any] = {
    **GLIDER,
    "joints": {
        "rail": {**GLIDER["joints"]["rail"], "friction": {"force": "2 N"}, "start": {"q": 0, "qd": 1.0}},
    },
}
"""A block of 1 kg that slides to rest."""
FORCE = "joints.rail.friction.force"


def slid(force: float, v: float | np.ndarray, time: np.ndarray) -> np.ndarray:
    """Travel of the slider, m."""
    t = np.minimum(time, v / force)
    return v * t - 0.5 * force * t * t


def slid_slopes(force: float, v: float, time: np.ndarray) -> np.ndarray:
    """Derivatives of the travel with respect to the force and the speed (n × 2). The stopping time also depends on force and speed.
    The stopping time adds nothing to the derivatives, because the speed is zero at that time."""
    t = np.minimum(time, v / force)
    return np.column_stack([-0.5 * t * t, t])
