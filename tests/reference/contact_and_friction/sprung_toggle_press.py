"""A plane toggle press of two equal links. A spring holds the foot sideways. Near the change point, the lateral reaction of the
rigid mechanism has two roots, or none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

LINK, SIDE, DENSITY = 0.3, 0.06, 7800.0
MASS = DENSITY * SIDE**2 * LINK
INERTIA = MASS * (SIDE**2 + LINK**2) / 12
RAM = DENSITY * 0.2 * 0.2 * 0.1
CIRCLE = 0.02 * 0.1 / np.sqrt(1.01)
"""Friction circle of a pin of radius 0.02 m with μ = 0.1, m."""
GRAVITY = 9.81
SLOW = 1e-4
"""Rate below which friction is reduced, rad/s."""


def _along(q: float) -> np.ndarray:
    return np.array([-np.sin(q), -np.cos(q)])


def _turned(q: float) -> np.ndarray:
    return np.array([-np.cos(q), np.sin(q)])


@dataclass
class SprungToggle:
    """stiffness, N/m, and damping, N s/m, of the foot across its path. push: N, across, at the knee, a function of time. States are
    [half the difference of the links' angles, half their sum, and their rates]. The sum is zero if the foot is on its path."""

    stiffness: float
    damping: float
    push: Callable[[float], float]
    pins: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def rates(self, t: float, y: np.ndarray) -> np.ndarray:
        """ẏ from the balance of both links and the ram. Iteration from the last friction gives the friction."""
        half, lean, half_rate, lean_rate = y
        a, b, wa, wb = half + lean, lean - half, half_rate + lean_rate, lean_rate - half_rate
        gap = -2 * LINK * np.sin(lean) * np.cos(half)
        speed = -2 * LINK * (np.cos(lean) * np.cos(half) * lean_rate - np.sin(lean) * np.sin(half) * half_rate)
        across = -self.stiffness * gap - self.damping * speed
        inverse, rest = self.balance(self.push(t), across, a, b, wa, wb)
        sense = CIRCLE * np.tanh(np.array([wa, wb - wa, -wb]) / SLOW)
        for _ in range(60):
            friction = -sense * self.pins
            x = inverse @ (rest + np.r_[np.zeros(4), friction[0] - friction[1], friction[1] - friction[2], 0.0])
            found = np.array([np.hypot(x[2], x[3]), np.hypot(x[4], x[5]), np.hypot(across, x[6])])
            change, self.pins = np.abs(found - self.pins).max(), found
            if change <= 1e-12 * found.max():
                break
        return np.array([half_rate, lean_rate, (x[0] - x[1]) / 2, (x[0] + x[1]) / 2])

    @staticmethod
    def balance(push, across, a, b, wa, wb) -> tuple[np.ndarray, np.ndarray]:
        """(inverse, right side) for [α_upper, α_lower, force of crown on upper, of lower on upper, of ram on lower's path]."""
        da, db, ea, eb = _along(a), _along(b), _turned(a), _turned(b)
        A, r, h = np.zeros((7, 7)), np.zeros(7), LINK / 2
        A[:2, 0], A[:2, 2:4], A[:2, 4:6] = MASS * h * ea, -np.eye(2), -np.eye(2)
        A[2:4, 0], A[2:4, 1], A[2:4, 4:6], A[3, 6] = MASS * LINK * ea, MASS * h * eb, np.eye(2), -1.0
        A[4, 0], A[4, 2:4], A[4, 4:6] = INERTIA, h * ea, -h * ea
        A[5, 1], A[5, 4:6], A[5, 6] = INERTIA, -h * eb, -h * eb[1]
        A[6, :2], A[6, 6] = RAM * LINK * np.array([ea[1], eb[1]]), 1.0
        weight = np.array([0.0, -MASS * GRAVITY])
        r[:2] = MASS * h * wa**2 * da + weight + [push, 0.0]
        r[2:4] = MASS * (LINK * wa**2 * da + h * wb**2 * db) + weight + [across, 0.0]
        r[4:6] = h * ea[0] * push, h * eb[0] * across
        r[6] = RAM * (LINK * (wa**2 * da[1] + wb**2 * db[1]) - GRAVITY)
        return np.linalg.inv(A), r

    def run(self, start: float, stop: float, half: float, rate: float):
        """The motion from a start with the foot on its path, as a dense solution of SciPy."""
        exact = {"method": "Radau", "rtol": 1e-6, "atol": [1e-9, 1e-15, 1e-9, 1e-11], "dense_output": True}
        return solve_ivp(self.rates, (start, stop), [half, 0.0, rate, 0.0], **exact)
