"""Radau IIA of order 5 with step size control, for equations whose right-hand side is evaluated for many states at once.

Stiff directions that turn make Newton's method diverge with the Jacobian of the step's start. The Jacobian is therefore computed at
every stage, by finite differences, all columns of all stages in one evaluation. """

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import lu_factor, lu_solve

ROOT = 6**0.5
C = np.array([(4 - ROOT) / 10, (4 + ROOT) / 10, 1.0])
A = np.array([
    [(88 - 7 * ROOT) / 360, (296 - 169 * ROOT) / 1800, (-2 + 3 * ROOT) / 225],
    [(296 + 169 * ROOT) / 1800, (88 + 7 * ROOT) / 360, (-2 - 3 * ROOT) / 225],
    [(16 - ROOT) / 36, (16 + ROOT) / 36, 1 / 9],
])  # fmt: skip
INVERSE = np.linalg.inv(A)
REAL = 3 + 3 ** (2 / 3) - 3 ** (1 / 3)
"""The real eigenvalue of the inverse."""
ESTIMATE = np.array([-13 - 7 * ROOT, -13 + 7 * ROOT, -1]) / 3
"""Weights of the stages in the estimate of the error."""
NEWTON, RENEWED, MOST = 10, 1, 50_000
"""Iterations with one Jacobian; number of Jacobians in a step; steps of a run."""
SLOW, SOLVED = 0.3, 1e-3
"""Contraction above which the Jacobian is renewed; error of Newton's method, relative to the tolerance."""
CAUTION = 4
"""Number of steps after a failure in which the step size grows little."""
SMALLEST = 1e-14
"""Step, relative to the time, below which a run ends."""


class Stalled(ArithmeticError):
    """The step size fell below the resolution of time, or the run needs too many steps."""


@dataclass
class Run:
    """An integration. ``f(t, y)`` takes times (n) and states (n x d). nudge: steps of the finite differences."""

    f: Callable[[np.ndarray, np.ndarray], np.ndarray]
    t: float
    y: np.ndarray
    rtol: np.ndarray
    atol: np.ndarray
    nudge: np.ndarray
    h: float = 1e-6
    steps: int = 0
    wary: int = 0
    last: tuple[float, float, np.ndarray, np.ndarray] | None = None

    def restart(self, h: float = 1e-6) -> None:
        """Forget data of earlier steps. Needed at a kink of a signal and after a change of state."""
        self.h, self.last = min(h, self.h), None

    def step(self, end: float) -> tuple[float, np.ndarray, np.ndarray]:
        """Make one accepted step, at most to ``end``. Returns (start, state at the start, stages). The state of the run
        advances."""
        while True:
            self.steps += 1
            left = end - self.t
            h = left if self.h > 0.999 * left else self.h
            if h < SMALLEST * max(1.0, abs(end)) or self.steps > MOST:
                raise Stalled(f"at t = {self.t:.9g} s after {self.steps} steps")
            stages, own = self._newton(h)
            if stages is None:
                self.h, self.wary = h / 4, CAUTION
                continue
            error = self._error(h, stages, own)
            grow = 0.9 * (error + 1e-12) ** -0.25
            if error > 1:
                self.h, self.wary = h * max(0.1, grow), max(self.wary, 1)
                continue
            start = (self.t, self.y)
            self.last = (self.t, h, self.y, stages)
            self.t, self.y = (end if h == left else self.t + h), self.y + stages[2]
            grow = min(grow, 1.2 if self.wary else 5.0)
            self.wary = max(self.wary - 1, 0)
            self.h = max(h * grow, self.h if h < self.h else 0.0)
            return (*start, stages)

    def _differences(self, t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rates and Jacobians at several states."""
        n, d = y.shape
        many = np.concatenate([y[:, None], y[:, None] + np.diag(self.nudge)], axis=1).reshape(-1, d)
        out = self.f(np.repeat(t, d + 1), many).reshape(n, d + 1, d)
        return out[:, 0], ((out[:, 1:] - out[:, :1]) / self.nudge[:, None]).swapaxes(1, 2)

    def _newton(self, h: float) -> tuple[np.ndarray | None, np.ndarray | None]:
        """The stages' increments and the Jacobian at the start; None if the iteration does not converge."""
        d = len(self.y)
        Z = np.zeros((3, d)) if self.last is None else self._ahead(h)
        scale = self.atol + self.rtol * np.abs(self.y)
        times, first = self.t + h * C, None
        for _ in range(RENEWED + 1):
            F, J = self._differences(np.r_[self.t, times], np.vstack([self.y, self.y + Z]))
            if not (np.all(np.isfinite(F)) and np.all(np.isfinite(J))):
                return None, None
            first, F = J[0], F[1:]
            M = np.kron(INVERSE / h, np.eye(d))
            for k in range(3):
                M[k * d : k * d + d, k * d : k * d + d] -= J[k + 1]
            factors, before = lu_factor(M, check_finite=False), None
            for k in range(NEWTON):
                change = lu_solve(factors, (F - INVERSE @ Z / h).reshape(-1), check_finite=False).reshape(3, d)
                Z = Z + change
                size = float(np.sqrt(np.mean((change / scale) ** 2)))
                rate = size / before if before else 0.0
                if size < 1e-2 * SOLVED or (k > 0 and rate < 1 and rate / (1 - rate) * size < SOLVED):
                    return Z, first
                if (rate >= 1 and k > 1) or (rate > SLOW and k > 2):
                    break
                before = size
                F = self.f(times, self.y + Z)
                if not np.all(np.isfinite(F)):
                    return None, None
            if rate >= 2:
                break
        return None, None

    def _ahead(self, h: float) -> np.ndarray:
        """The values of the last step's polynomial, extrapolated to the next step."""
        t0, h0, y0, stages = self.last
        return y0 + polynomial(stages, (self.t + h * C - t0) / h0) - self.y

    def _error(self, h: float, stages: np.ndarray, J: np.ndarray) -> float:
        factors = lu_factor(REAL / h * np.eye(len(self.y)) - J, check_finite=False)
        scale = self.atol + self.rtol * np.maximum(np.abs(self.y), np.abs(self.y + stages[2]))
        pull, t = stages.T @ ESTIMATE / h, np.array([self.t])
        error = lu_solve(factors, self.f(t, self.y[None])[0] + pull, check_finite=False)
        size = float(np.sqrt(np.mean((error / scale) ** 2)))
        if size > 1:
            error = lu_solve(factors, self.f(t, (self.y + error)[None])[0] + pull, check_finite=False)
            size = float(np.sqrt(np.mean((error / scale) ** 2)))
        return size


def polynomial(stages: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The collocation polynomial of a step's increments at shares x of the step."""
    x = np.atleast_1d(x)[:, None]
    a, b, c = C
    basis = [x * (x - q) * (x - r) / (p * (p - q) * (p - r)) for p, q, r in ((a, b, c), (b, a, c), (c, a, b))]
    return sum(w * z for w, z in zip(basis, stages, strict=True))
