"""The least-squares objective of a fit (misfits and priors in units of their standard deviations), and its minimisation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from trunnion.analysis.fits.bounds_and_priors import BoundsAndPriors, check_start
from trunnion.analysis.fits.measurements import MeasuredRun
from trunnion.analysis.fits.model_curves import ModelCurves
from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.basics.optional_packages import brought

MOST_EVALUATIONS = 50
CONVERGED = 1e-9
"""The search ends if the relative change of the parameters or of the sum of squares is below this value."""
NO_INFLUENCE = 1e-11
"""A parameter has no influence if doubling the parameter changes the curves by less than this value, relative to their largest
value. Smaller changes are round-off."""
NOISE_FLOOR = 10.0
"""Least estimated standard deviation of the noise, in multiples of rtol times the largest value. Smaller misfits come from the
integration error of the run."""
SETTLED = 1e-2
"""The weights are final when the estimated noise changes by less than this relative value. The intervals then change by less than
half of this value."""
NOISE_ROUNDS = 8


class Objective:
    """The sum of squares as a function of u (m), the parameters in units of their start values.

    The residuals r (N + priors) are the misfits divided by the noise, followed by the residuals of the priors. J are the
    derivatives of r by u.

    Attributes:
        noise: standard deviation of every value (N).
        groups: for each value, the index of its estimated noise (N); values with the same index share their noise.
        given: whether the noise is given instead of estimated.
        nu: degrees of freedom of the estimated noise.
        least: the least sum of squares that the search has found.
    """

    def __init__(self, curves: ModelCurves, known: BoundsAndPriors, start: np.ndarray, groups: np.ndarray):
        self.curves, self.known, self.groups = curves, known, groups
        self.data = np.concatenate([v for r in curves.runs for v in r.curves.values()])
        self.start, self.unit = start, np.where(start == 0.0, 1.0, np.abs(start))
        self.low, self.high = known.low / self.unit, known.high / self.unit
        check_start(start, known)
        deviations = [r.deviations() for r in curves.runs]
        self.given = deviations[0] is not None
        each = [s[c] for r, s in zip(curves.runs, deviations, strict=True) if s for c in r.curves for _ in range(len(r.time))]
        self.noise = np.array(each) if self.given else np.ones(len(self.data))
        self.nu = math.inf
        self.least = math.inf
        self.failed: list[str] = []

    @property
    def m(self) -> int:
        """Number of parameters."""
        return len(self.unit)

    def residuals(self, u: np.ndarray) -> np.ndarray:
        """The residuals r at u, from plain runs. Raises SceneError or SimulationError if the runs fail."""
        return self._with_priors(self.curves.values(u * self.unit), u)

    def slopes(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(r, J) at u."""
        values, by = self.curves.slopes(u * self.unit)
        rows = np.zeros((len(self.known.priors), self.m))
        for row, (i, prior) in zip(rows, self.known.priors.items(), strict=True):
            row[i] = prior.residual(float(u[i] * self.unit[i]))[1] * self.unit[i]
        return self._with_priors(values, u), np.vstack([by * self.unit / self.noise[:, None], rows])

    def _with_priors(self, values: np.ndarray, u: np.ndarray) -> np.ndarray:
        misses = [prior.residual(float(u[i] * self.unit[i]))[0] for i, prior in self.known.priors.items()]
        return np.concatenate([(values - self.data) / self.noise, misses])

    def search(self, u: np.ndarray) -> Any:
        """SciPy's result of a search from u within the bounds.

        If one parameter must not exceed another, the search variables are the lower parameter and the difference of both.
        """
        least_squares = brought("scipy.optimize", "analysis", "fit").least_squares
        T, low, high = np.eye(self.m), self.low.copy(), self.high.copy()
        for a, b in self.curves.pairs:
            T[b, a] = self.unit[a] / self.unit[b]
            low[b], high[b] = 0.0, np.inf
        w = np.clip(np.linalg.solve(T, u), low, high)
        self.least = math.inf
        found = least_squares(
            lambda w: self._trial_residuals(T @ w), w, lambda w: self.slopes(T @ w)[1] @ T, (low, high), "trf", CONVERGED,
            CONVERGED, None, "jac", max_nfev=MOST_EVALUATIONS,
        )
        found.x = T @ found.x
        return found

    def _trial_residuals(self, u: np.ndarray) -> np.ndarray:
        """Residuals of a trial step. They are infinite if the scene of the step is invalid or its run fails; the search then
        shortens the step. Derivatives are computed only for a step that decreases the sum of squares.
        """
        try:
            r = self.residuals(u)
            if r @ r >= self.least:
                return r
            r = self.slopes(u)[0]
            self.least = float(r @ r)
            return r
        except (SceneError, SimulationError) as e:
            values = ", ".join(f"{n} = {v:g}" for n, v in zip(self.known.names, u * self.unit, strict=True))
            self.failed.append(f"a run of the search failed, and a shorter step was taken: {values}: {e}")
            return np.full(len(self.data) + len(self.known.priors), np.inf)

    def check_influence(self) -> None:
        """Raise SceneError if a parameter does not change any measured curve; the error names all such parameters."""
        by = self.slopes(self.start / self.unit)[1][: len(self.data)] * self.noise[:, None]
        most = np.abs(self.data).max()
        still = [n for n, c in zip(self.known.names, by.T, strict=True) if np.abs(c).max() <= NO_INFLUENCE * most]
        if still:
            hint = "leave it out, or measure a quantity that it changes"
            raise SceneError([Problem("parameters", f"{n} changes none of the measured curves", hint) for n in still])

    def minimise(self, u: np.ndarray) -> tuple[np.ndarray, int, bool]:
        """(u at the minimum, number of trial points, whether the search converged). Noise that is not given is estimated
        iteratively."""
        found = self.search(u)
        rounds, alone = found.nfev, not self.known.priors and len(set(self.groups.tolist())) == 1
        if not self.given:
            for _ in range(NOISE_ROUNDS):
                change = self._estimate(found.x)
                if alone or change < SETTLED:
                    break
                found = self.search(found.x)
                rounds += found.nfev
        return self.curves.apply_order(found.x * self.unit) / self.unit, rounds, found.status > 0

    def _estimate(self, u: np.ndarray) -> float:
        """Estimate the noise and its degrees of freedom from the misfit at u; returns the largest relative change of the noise."""
        r, J = self.slopes(u)
        n = len(self.data)
        size = np.linalg.norm(J, axis=0)
        size[size == 0.0] = 1.0
        used = float(np.trace(J[:n] / size @ np.linalg.pinv(J.T @ J / np.outer(size, size)) @ (J[:n] / size).T))
        self.nu = max(n - used, 1.0)
        before, misfit = self.noise.copy(), r[:n] * self.noise
        for g in set(self.groups.tolist()):
            here = self.groups == g
            floor = NOISE_FLOOR * self.curves.rtol * max(np.abs(self.data[here]).max(), 1e-300)
            self.noise[here] = max(math.sqrt((misfit[here] @ misfit[here]) / here.sum() * n / self.nu), floor)
        return float(np.abs(self.noise / before - 1.0).max())


def noise_groups(units: Sequence[str], runs: Sequence[MeasuredRun]) -> np.ndarray:
    """For each of the N values, the index of its estimated noise. All curves of one unit share their noise."""
    which = {unit: i for i, unit in enumerate(dict.fromkeys(units))}
    lengths = [len(v) for r in runs for v in r.curves.values()]
    return np.repeat([which[unit] for unit in units], lengths)
