"""Profile-likelihood intervals: the values of a parameter for which the best fit of the other parameters is not significantly
worse.

The rise of the sum of squares along the profile is distributed as χ²(1) for given noise, and as F(1, ν) for estimated noise. For
models that are linear in their parameters, this distribution is exact, and the interval equals the local interval.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from trunnion.analysis.fits.least_squares_objective import Objective
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.basics.json_values import finite
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.optional_packages import brought

END_TOLERANCE = 1e-3
"""At an end of an interval, √rise may differ from its threshold by at most this value, relative to the threshold. The relative
error of the interval's width is then at most this value."""
LEAST_DECREASE = 1e-4
"""The minimisation ends if the expected decrease of the sum of squares, relative to the square of the threshold, is below this
value."""
MOST_TRIALS = 14
MOST_STEPS = 12
MOST_LOG_FACTOR = 3.0
"""If parameter k makes a step, every other positive parameter is multiplied by a factor. This value is the largest absolute
logarithm of the factor."""
MOST_WIDENING = 2.5
"""Largest factor by which the search for an end widens its step."""
ABRUPT = 30.0
"""A point with √rise above this multiple of the threshold is not used for linear interpolation."""
LEAST_RISE = 0.3
"""The search for a lower end stops below a tenth of the estimate if √rise, relative to the threshold, is still below this value."""
NEARLY_ZERO = 1e-6
"""An estimate counts as zero if its magnitude, relative to its start value, is below this value."""
SEARCH_RANGE = 10.0
"""The search for an end stops at this multiple of the estimate. For parameters of any sign, the search stops at the estimate ± this
many magnitudes."""
LEAST_FALL = 1e-2
"""A fit counts as better if its sum of squares is below the minimum by this multiple of the square of the threshold."""
Rows = np.ndarray


@dataclass(frozen=True)
class Interval:
    """The confidence interval of a parameter at the fit's level, in the parameter's SI unit.

    Attributes:
        low: lower end, from the profile.
        high: upper end, from the profile.
        low_end: kind of the lower end: ``found``, ``bound`` (the data allow all values up to the parameter's bound) or ``open``
            (the data allow all values that were tried).
        high_end: kind of the upper end.
        local: interval from the curvature at the estimate; infinite if the curvature is zero.
        values: k values of the parameter along the profile.
        rises: rises of the weighted sum of squares along the profile (k), dimensionless.
    """

    low: float
    high: float
    low_end: str
    high_end: str
    local: tuple[float, float]
    values: np.ndarray
    rises: np.ndarray

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers. Infinite ends become None."""
        ends = {"low": self.low, "high": self.high, "low_end": self.low_end, "high_end": self.high_end}
        return ends | {"local": finite(self.local), "profile": {"values": self.values.tolist(), "rises": self.rises.tolist()}}


def threshold(level: float, nu: float) -> float:
    """√rise at the ends of an interval. The threshold follows from χ²(1), or from F(1, ν) for noise estimated with ν degrees of
    freedom."""
    special, p = brought("scipy.special", "analysis", "fit"), 0.5 + 0.5 * level
    return float(special.ndtri(p) if math.isinf(nu) else special.stdtrit(nu, p))


class BetterFitFound(Exception):
    """A profile found a better fit at u (m). The search must start again from u."""

    def __init__(self, u: np.ndarray):
        super().__init__("a better fit")
        self.u = u


class Profiles:
    """Profiles about a minimum u (m), with the residuals r and the derivatives J at u. t: threshold of √rise."""

    def __init__(self, objective: Objective, u: np.ndarray, t: float):
        self.objective, self.u, self.t = objective, u, t
        self.r, self.J = objective.slopes(u)
        self.least = float(self.r @ self.r)

    def fit_others(self, k: int, u: np.ndarray, J: Rows) -> tuple[np.ndarray, Rows, float]:
        """Minimise over all parameters except k, starting from u; returns (u, J, rise). Broyden's update keeps J current.

        Raises BetterFitFound if the sum of squares is below the minimum. Raises SceneError or SimulationError if the run at u
        fails.
        """
        others = [i for i in range(len(u)) if i != k]
        r = self.objective.residuals(u)
        damping = 0.0
        for trial in range(MOST_STEPS):
            step = self._step(u, others, J, r, damping)
            predicted = float(r @ r - np.sum((r + J @ step) ** 2))
            if predicted <= LEAST_DECREASE * self.t**2:
                break
            if trial == MOST_STEPS // 2:  # slow convergence: Broyden's update no longer approximates J
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
        if rise < -LEAST_FALL * self.t**2:
            raise BetterFitFound(u)
        return u, J, max(rise, 0.0)

    def _step(self, u: np.ndarray, others: list[int], J: Rows, r: np.ndarray, damping: float) -> np.ndarray:
        """The Gauss–Newton step of the parameters ``others`` within their bounds, computed with an active set."""
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

    def _predict(self, k: int, u: np.ndarray, J: Rows, to: float) -> np.ndarray:
        """The vector u with parameter k set to a value. The other parameters change as the derivatives predict: positive parameters
        are multiplied by factors, and amounts are added to all other parameters."""
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
            moved[others] = np.where(
                factor, u[others] * np.exp(np.clip(follow, -MOST_LOG_FACTOR, MOST_LOG_FACTOR)), u[others] + follow * size[others]
            )
        moved[k] = to
        return np.clip(moved, self.objective.low, self.objective.high)

    def rise_at(self, k: int, to: float) -> float:
        """The rise of the data's sum of squares (without priors) if parameter k has the value ``to``, in units of u. NaN if the run
        fails."""
        n = len(self.objective.data)
        try:
            u = self.fit_others(k, self._predict(k, self.u, self.J, to), self.J)[0]
            r = self.objective.residuals(u)[:n]
        except (SceneError, SimulationError):
            return math.nan
        return float(r @ r - self.r[:n] @ self.r[:n])

    def interval(self, k: int, deviation: float) -> Interval:
        """The interval of parameter k. deviation: its local standard deviation in units of u, which may be infinite."""
        ends, points = [], [(float(self.u[k]), 0.0)]
        for sign in (-1.0, 1.0):
            end, kind, seen = self._find_end(k, sign, deviation)
            ends.append((end, kind))
            points += seen
        points.sort()
        unit = self.objective.unit[k]
        middle, half = float(self.u[k] * unit), float(self.t * deviation * unit)
        values, rises = (np.array(c) for c in zip(*points, strict=True))
        (low, low_end), (high, high_end) = ends
        ends_ = float(low * unit), float(high * unit), low_end, high_end
        return Interval(*ends_, (middle - half, middle + half), values * unit, rises)

    def _search_limit(self, k: int, sign: float, deviation: float) -> tuple[float, bool]:
        """(limit of the search for an end, whether this limit is the parameter's bound)."""
        u, low, high = float(self.u[k]), self.objective.low[k], self.objective.high[k]
        unit = self.objective.unit
        low = max([low, *(self.u[a] * unit[a] / unit[k] for a, b in self.objective.curves.pairs if b == k)])
        size = abs(u) if abs(u) > NEARLY_ZERO else 1.0
        least = SEARCH_RANGE * self.t * deviation if math.isfinite(deviation) else 0.0
        if low >= 0.0 and u > NEARLY_ZERO:
            far = (
                max(u * SEARCH_RANGE, u + least)
                if sign > 0
                else max(low, u / SEARCH_RANGE)
                if low > 0.0 or not self._can_run(k, low)
                else low
            )
        else:
            far = u + sign * max(SEARCH_RANGE * size, least)
        bound = high if sign > 0 else low
        return (float(bound), True) if sign * (far - bound) >= 0.0 else (far, False)

    def _can_run(self, k: int, to: float) -> bool:
        """Whether the run succeeds if parameter k has the value ``to``."""
        moved = self.u.copy()
        moved[k] = to
        try:
            self.objective.residuals(moved)
        except (SceneError, SimulationError):
            return False
        return True

    def _find_end(self, k: int, sign: float, deviation: float) -> tuple[float, str, list[tuple[float, float]]]:
        """(end, kind, points (value, rise) of the profile) on one side. The search makes secant steps on √rise, which is a nearly
        linear function."""
        far, is_bound = self._search_limit(k, sign, deviation)
        u, J, stalled = self.u, self.J, 0
        inner, outer = (float(u[k]), 0.0), None
        points: list[tuple[float, float]] = []
        size = abs(u[k]) if abs(u[k]) > NEARLY_ZERO else 1.0
        step = self.t * deviation if math.isfinite(deviation) else 0.25 * size
        to = float(u[k] + sign * step)
        for _ in range(MOST_TRIALS):
            to = far if sign * (to - far) > 0.0 else to
            try:
                moved, slopes, rise = self.fit_others(k, self._predict(k, u, J, to), J)
            except (SceneError, SimulationError):
                outer = (to, math.inf)
                to = 0.5 * (inner[0] + to)
                if abs(to - inner[0]) <= END_TOLERANCE * abs(inner[0] - self.u[k]):
                    break
                continue
            root = math.sqrt(rise)
            points.append((to, rise))
            if abs(root - self.t) <= END_TOLERANCE * self.t:
                return to, "found", points
            if root < self.t:
                inner, u, J, stalled = (to, root), moved, slopes, stalled + 1
                if to == far:
                    return to, "bound" if is_bound else "open", points
                if self._is_near_zero(k, to) and outer is not None and root < LEAST_RISE * self.t:
                    return to, "open", points
            else:
                outer, stalled = (to, root), 0
            to = self._next_value(k, inner, outer, to) if outer is None or stalled < 2 else 0.5 * (inner[0] + outer[0])
        if outer is None or math.isinf(outer[1]):
            return inner[0], "open", points
        return self._interpolate(inner, outer), "found", points

    def _is_near_zero(self, k: int, to: float) -> bool:
        """Whether the value of a positive parameter is below a tenth of the estimate. At such a value, the search for an end may
        stop."""
        return bool(self.objective.low[k] == 0.0 < to <= self.u[k] / SEARCH_RANGE)

    def _next_value(self, k: int, inner: tuple[float, float], outer: tuple[float, float] | None, tried: float) -> float:
        """The next value to try: between the points below and above the threshold, or further out if no point is above the
        threshold."""
        if outer is None:
            return float(self.u[k]) + (tried - float(self.u[k])) * min(
                max(1.02 * self.t / max(inner[1], 1e-12), 1.05), MOST_WIDENING
            )
        return self._interpolate(inner, outer) if outer[1] < ABRUPT * self.t else 0.5 * (inner[0] + outer[0])

    def _interpolate(self, inner: tuple[float, float], outer: tuple[float, float]) -> float:
        share = (self.t - inner[1]) / (outer[1] - inner[1])
        return inner[0] + min(max(share, 0.01), 0.99) * (outer[0] - inner[0])
