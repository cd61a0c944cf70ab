"""Profile-likelihood intervals: how far a parameter may go before the best fit with it held there is significantly worse.

With noise given, the rise of the sum of squares along the profile is χ² with one degree of freedom; with noise estimated, over its
estimate, F with one and ν: both are exact for models linear in their parameters, where the interval is the local one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine.basics.extras import brought
from engine.basics.problems import SceneError, SimulationError
from engine.fits.problem import Objective

NEAR = 1e-3
"""How near √rise comes to its threshold at an end, of the threshold: the interval's width is off by no more."""
STILL = 1e-4
"""Decrease of the sum of squares expected of another step, of the threshold's square, that is not worth a run."""
TRIALS = 14
STEPS = 12
MOST = 3.0
"""Most that a positive parameter is moved at once in following another: logarithm of its factor."""
WIDER = 2.5
"""Most that the search for an end goes further out at once."""
ABRUPT = 30.0
"""Times the threshold of √rise from which on it does not rise in a line."""
HARDLY = 0.3
"""Part of the threshold that √rise must have reached at a tenth of the estimate for an end to be looked for nearer to zero."""
SMALL = 1e-6
"""Part of a start value below which an estimate counts as zero."""
FAR = 10.0
"""Times the estimate (for numbers that may have any sign: estimate ± this many of its size) where the search for an end gives
up."""
BETTER = 1e-2
"""Fall of the sum of squares below its minimum, of the threshold's square, that says the minimum was none."""
Rows = np.ndarray


@dataclass(frozen=True)
class Interval:
    """Where a parameter lies, at the fit's level. low, high: by the profile; low_end, high_end: ``found``, ``bound`` (the data
    allow all values up to that bound) or ``open`` (they allow all that was looked at); local: by the curvature at the estimate,
    infinite where that is zero; values (k), rises (k): the profile, of the parameter and of the sum of squares, by the value."""

    low: float
    high: float
    low_end: str
    high_end: str
    local: tuple[float, float]
    values: np.ndarray
    rises: np.ndarray

    def document(self) -> dict[str, Any]:
        """As plain data; ends that are infinite are None."""
        local = [x if math.isfinite(x) else None for x in self.local]
        return {"low": self.low, "high": self.high, "low_end": self.low_end, "high_end": self.high_end, "local": local,
                "profile": {"values": self.values.tolist(), "rises": self.rises.tolist()}}  # fmt: skip


def threshold(level: float, nu: float) -> float:
    """√ of the rise at the ends of an interval: of χ² with 1, or with noise estimated with ν degrees of freedom, of F with 1, ν."""
    stats = brought("scipy.stats", "analysis", "fit")
    return float(stats.norm.ppf(0.5 + 0.5 * level) if math.isinf(nu) else stats.t.ppf(0.5 + 0.5 * level, nu))


class Better(Exception):  # an answer, no error
    """A better fit was met on the way: u, where."""

    def __init__(self, u: np.ndarray):
        super().__init__("a better fit")
        self.u = u


class Profiles:
    """Profiles about a minimum u, where the rows are r and their slopes J. t: threshold of √rise."""

    def __init__(self, objective: Objective, u: np.ndarray, t: float):
        self.objective, self.u, self.t = objective, u, t
        self.r, self.J = objective.slopes(u)
        self.least = float(self.r @ self.r)

    def relaxed(self, k: int, u: np.ndarray, J: Rows) -> tuple[np.ndarray, Rows, float]:
        """(u, J, rise) of the best fit with parameter k held where u has it, from u on; J follows by Broyden's update. Better when
        it is below the minimum. SceneError or SimulationError where u cannot be run."""
        others = [i for i in range(len(u)) if i != k]
        r = self.objective.residuals(u)
        damping = 0.0
        for trial in range(STEPS):
            step = self._step(u, others, J, r, damping)
            predicted = float(r @ r - np.sum((r + J @ step) ** 2))
            if predicted <= STILL * self.t**2:
                break
            if trial == STEPS // 2:  # slow: the slopes have changed by more than the update follows
                r, J = self.objective.slopes(u)
            try:
                tried = self.objective.residuals(u + step)
            except (SceneError, SimulationError):
                damping = max(4.0 * damping, 0.1)
                continue
            J = J + np.outer(tried - r - J @ step, step) / float(step @ step)
            if tried @ tried < r @ r:
                u, r, damping = u + step, tried, 0.25 * damping
            else:
                damping = max(4.0 * damping, 0.1)
        rise = float(r @ r) - self.least
        if rise < -BETTER * self.t**2:
            raise Better(u)
        return u, J, max(rise, 0.0)

    def _step(self, u: np.ndarray, others: list[int], J: Rows, r: np.ndarray, damping: float) -> np.ndarray:
        """The Gauss–Newton step of the others inside their bounds: those that it would carry out stop there, and the rest again."""
        step, free = np.zeros(len(u)), list(others)
        low, high = self.objective.low, self.objective.high
        while free:
            size = np.linalg.norm(J[:, free], axis=0)
            size[size == 0.0] = 1.0
            A, b = J[:, free] / size, -(r + J @ np.where(np.isin(np.arange(len(u)), free), 0.0, step))
            if damping:
                A, b = np.vstack([A, math.sqrt(damping) * np.eye(len(free))]), np.append(b, np.zeros(len(free)))
            step[free] = np.linalg.lstsq(A, b, rcond=1e-9)[0] / size
            out = [i for i in free if not low[i] <= u[i] + step[i] <= high[i]]
            if not out:
                break
            for i in out:
                step[i] = np.clip(u[i] + step[i], low[i], high[i]) - u[i]
                free.remove(i)
        return step

    def _towards(self, k: int, u: np.ndarray, J: Rows, to: float) -> np.ndarray:
        """u with parameter k moved to a value, the others following the slopes: positive ones by factors, the others by sums."""
        others = [i for i in range(len(u)) if i != k]
        by_factor = (self.objective.low >= 0.0) & (u > 0.0)
        by_factor[k] &= to > 0.0
        size = np.where(by_factor, u, 1.0)
        way = math.log(to / u[k]) if by_factor[k] else (to - u[k]) / size[k]
        moved = u.copy()
        if others:
            scaled = J * size
            norm = np.linalg.norm(scaled[:, others], axis=0)
            norm[norm == 0.0] = 1.0
            follow = -np.linalg.lstsq(scaled[:, others] / norm, scaled[:, k] * way, rcond=1e-9)[0] / norm
            factor = by_factor[others]
            moved[others] = np.where(factor, u[others] * np.exp(np.clip(follow, -MOST, MOST)), u[others] + follow * size[others])
        moved[k] = to
        return np.clip(moved, self.objective.low, self.objective.high)

    def at(self, k: int, to: float) -> float:
        """The rise of the data's own sum of squares, without priors, with parameter k held at a value (in u) near the minimum; NaN
        where that cannot be run."""
        n = len(self.objective.data)
        try:
            u = self.relaxed(k, self._towards(k, self.u, self.J, to), self.J)[0]
            r = self.objective.residuals(u)[:n]
        except (SceneError, SimulationError):
            return math.nan
        return float(r @ r - self.r[:n] @ self.r[:n])

    def interval(self, k: int, deviation: float) -> Interval:
        """The interval of parameter k. deviation: its local standard deviation in u, infinite where there is none."""
        ends, points = [], [(float(self.u[k]), 0.0)]
        for sign in (-1.0, 1.0):
            end, kind, seen = self._end(k, sign, deviation)
            ends.append((end, kind))
            points += seen
        points.sort()
        unit = self.objective.unit[k]
        middle, half = float(self.u[k] * unit), float(self.t * deviation * unit)
        values, rises = (np.array(c) for c in zip(*points, strict=True))
        (low, low_end), (high, high_end) = ends
        ends_ = float(low * unit), float(high * unit), low_end, high_end
        return Interval(*ends_, (middle - half, middle + half), values * unit, rises)

    def _reach(self, k: int, sign: float, deviation: float) -> tuple[float, bool]:
        """(how far an end is looked for, whether that is a bound)."""
        u, low, high = float(self.u[k]), self.objective.low[k], self.objective.high[k]
        unit = self.objective.unit
        low = max([low, *(self.u[a] * unit[a] / unit[k] for a, b in self.objective.curves.pairs if b == k)])
        size = abs(u) if abs(u) > SMALL else 1.0
        least = FAR * self.t * deviation if math.isfinite(deviation) else 0.0
        if low >= 0.0 and u > SMALL:
            far = max(u * FAR, u + least) if sign > 0 else max(low, u / FAR) if low > 0.0 or not self._runs(k, low) else low
        else:
            far = u + sign * max(FAR * size, least)
        bound = high if sign > 0 else low
        return (float(bound), True) if sign * (far - bound) >= 0.0 else (far, False)

    def _runs(self, k: int, to: float) -> bool:
        """Whether a value can be run."""
        moved = self.u.copy()
        moved[k] = to
        try:
            self.objective.residuals(moved)
        except (SceneError, SimulationError):
            return False
        return True

    def _end(self, k: int, sign: float, deviation: float) -> tuple[float, str, list[tuple[float, float]]]:
        """(end, kind, points of the profile (value, rise)) on one side: secant steps on √rise, which is nearly linear."""
        far, is_bound = self._reach(k, sign, deviation)
        u, J, stalled = self.u, self.J, 0
        inner, outer = (float(u[k]), 0.0), None
        points: list[tuple[float, float]] = []
        size = abs(u[k]) if abs(u[k]) > SMALL else 1.0
        step = self.t * deviation if math.isfinite(deviation) else 0.25 * size
        to = float(u[k] + sign * step)
        for _ in range(TRIALS):
            to = far if sign * (to - far) > 0.0 else to
            try:
                moved, slopes, rise = self.relaxed(k, self._towards(k, u, J, to), J)
            except (SceneError, SimulationError):
                outer = (to, math.inf)
                to = 0.5 * (inner[0] + to)
                if abs(to - inner[0]) <= NEAR * abs(inner[0] - self.u[k]):
                    break
                continue
            root = math.sqrt(rise)
            points.append((to, rise))
            if abs(root - self.t) <= NEAR * self.t:
                return to, "found", points
            if root < self.t:
                inner, u, J, stalled = (to, root), moved, slopes, stalled + 1
                if to == far:
                    return to, "bound" if is_bound else "open", points
                if self._near_zero(k, to) and outer is not None and root < HARDLY * self.t:
                    return to, "open", points
            else:
                outer, stalled = (to, root), 0
            to = self._next(k, inner, outer, to) if outer is None or stalled < 2 else 0.5 * (inner[0] + outer[0])
        if outer is None or math.isinf(outer[1]):
            return inner[0], "open", points
        return self._between(inner, outer), "found", points

    def _near_zero(self, k: int, to: float) -> bool:
        """Whether a value is so much nearer to zero, which bounds it, than the estimate that the search for an end gives up."""
        return bool(self.objective.low[k] == 0.0 < to <= self.u[k] / FAR)

    def _next(self, k: int, inner: tuple[float, float], outer: tuple[float, float] | None, tried: float) -> float:
        """Where to look next: between a point below the threshold and one above, or further out."""
        if outer is None:
            return float(self.u[k]) + (tried - float(self.u[k])) * min(max(1.02 * self.t / max(inner[1], 1e-12), 1.05), WIDER)
        return self._between(inner, outer) if outer[1] < ABRUPT * self.t else 0.5 * (inner[0] + outer[0])

    def _between(self, inner: tuple[float, float], outer: tuple[float, float]) -> float:
        share = (self.t - inner[1]) / (outer[1] - inner[1])
        return inner[0] + min(max(share, 0.01), 0.99) * (outer[0] - inner[0])
