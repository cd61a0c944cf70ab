"""The objective of a fit: misfits in units of their noise, and priors in units of theirs; the search for its minimum."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from engine.basics.extras import brought
from engine.basics.problems import Problem, SceneError, SimulationError
from engine.fits.curves import Curves
from engine.fits.known import Known, inside
from engine.fits.measured import Measured

ROUNDS = 50
ENOUGH = 1e-9
"""Relative change of the parameters, or of the sum of squares, below which the search ends."""
NOTHING = 1e-11
"""Change of the curves when a parameter doubles, of their largest value, that is the round-off of a run."""
FLOOR = 10.0
"""Least standard deviation of the noise, in rtol times the largest value: below it, the misfit is the run's own error."""
SETTLED = 1e-2
"""Relative change of estimated noise below which its weights stay: intervals then change by less than half of that."""
TURNS = 8


class Objective:
    """The sum of squares as a function of u, the parameters in units of their start values.

    r (N + priors): misfits over the noise, then priors; J: their derivatives by u. noise (N): its standard deviation at every
    value; groups (N): which values share one that is estimated; given: whether it is given; nu: degrees of freedom of the estimate;
    least: sum of squares that the search is at.
    """

    def __init__(self, curves: Curves, known: Known, start: np.ndarray, groups: np.ndarray):
        self.curves, self.known, self.groups = curves, known, groups
        self.data = np.concatenate([v for r in curves.runs for v in r.curves.values()])
        self.start, self.unit = start, np.where(start == 0.0, 1.0, np.abs(start))
        self.low, self.high = known.low / self.unit, known.high / self.unit
        inside(start, known)
        deviations = [r.deviations() for r in curves.runs]
        self.given = deviations[0] is not None
        each = [s[c] for r, s in zip(curves.runs, deviations, strict=True) if s for c in r.curves for _ in range(len(r.time))]
        self.noise = np.array(each) if self.given else np.ones(len(self.data))
        self.nu = math.inf
        self.least = math.inf
        self.failed: list[str] = []

    @property
    def m(self) -> int:
        """How many parameters there are."""
        return len(self.unit)

    def residuals(self, u: np.ndarray) -> np.ndarray:
        """r at u, from plain runs; SceneError or SimulationError where these cannot be made."""
        return self._with_priors(self.curves.values(u * self.unit), u)

    def slopes(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(r, J) at u."""
        values, by = self.curves.slopes(u * self.unit)
        rows = np.zeros((len(self.known.priors), self.m))
        for row, (i, prior) in zip(rows, self.known.priors.items(), strict=True):
            row[i] = prior.miss(float(u[i] * self.unit[i]))[1] * self.unit[i]
        return self._with_priors(values, u), np.vstack([by * self.unit / self.noise[:, None], rows])

    def _with_priors(self, values: np.ndarray, u: np.ndarray) -> np.ndarray:
        misses = [prior.miss(float(u[i] * self.unit[i]))[0] for i, prior in self.known.priors.items()]
        return np.concatenate([(values - self.data) / self.noise, misses])

    def search(self, u: np.ndarray) -> Any:
        """SciPy's answer from u, inside the bounds, by exact slopes. Of two numbers in order the higher is looked for by what it
        exceeds the other."""
        least_squares = brought("scipy.optimize", "analysis", "fit").least_squares
        T, low, high = np.eye(self.m), self.low.copy(), self.high.copy()
        for a, b in self.curves.pairs:
            T[b, a] = self.unit[a] / self.unit[b]
            low[b], high[b] = 0.0, np.inf
        w = np.clip(np.linalg.solve(T, u), low, high)
        self.least = math.inf
        found = least_squares(
            lambda w: self._tried(T @ w), w, lambda w: self.slopes(T @ w)[1] @ T, (low, high), "trf", ENOUGH, ENOUGH, None, "jac",
            max_nfev=ROUNDS,
        )
        found.x = T @ found.x
        return found

    def _tried(self, u: np.ndarray) -> np.ndarray:
        """Residuals of a trial; infinite where its scene cannot be made or run, so that the search shortens its step. Where they
        are no less than those there are it turns back and asks for no slopes: plain runs, which give the same, say so."""
        try:
            r = self.residuals(u)
            if r @ r >= self.least:
                return r
            r = self.slopes(u)[0]
            self.least = float(r @ r)
            return r
        except (SceneError, SimulationError) as e:
            values = ", ".join(f"{n} = {v:g}" for n, v in zip(self.known.names, u * self.unit, strict=True))
            self.failed.append(f"a trial failed, and a shorter step was taken: {values}: {e}")
            return np.full(len(self.data) + len(self.known.priors), np.inf)

    def check_moving(self) -> None:
        """SceneError for every parameter that changes none of the measured curves."""
        by = self.slopes(self.start / self.unit)[1][: len(self.data)] * self.noise[:, None]
        most = np.abs(self.data).max()
        still = [n for n, c in zip(self.known.names, by.T, strict=True) if np.abs(c).max() <= NOTHING * most]
        if still:
            hint = "leave it out, or measure something it changes"
            raise SceneError([Problem("parameters", f"{n} changes none of the measured curves", hint) for n in still])

    def minimise(self, u: np.ndarray) -> tuple[np.ndarray, int, bool]:
        """(u at the minimum, runs it took, whether the search came to its end). Noise that is not given is estimated, with weights
        and priors following it until it settles."""
        found = self.search(u)
        rounds, alone = found.nfev, not self.known.priors and len(set(self.groups.tolist())) == 1
        if not self.given:
            for _ in range(TURNS):
                change = self._estimate(found.x)
                if alone or change < SETTLED:
                    break
                found = self.search(found.x)
                rounds += found.nfev
        return self.curves.projected(found.x * self.unit) / self.unit, rounds, found.status > 0

    def _estimate(self, u: np.ndarray) -> float:
        """Estimate the noise of each group from the misfit at u, and its degrees of freedom; the largest relative change."""
        r, J = self.slopes(u)
        n = len(self.data)
        size = np.linalg.norm(J, axis=0)
        size[size == 0.0] = 1.0
        used = float(np.trace(J[:n] / size @ np.linalg.pinv(J.T @ J / np.outer(size, size)) @ (J[:n] / size).T))
        self.nu = max(n - used, 1.0)
        before, misfit = self.noise.copy(), r[:n] * self.noise
        for g in set(self.groups.tolist()):
            here = self.groups == g
            floor = FLOOR * self.curves.rtol * max(np.abs(self.data[here]).max(), 1e-300)
            self.noise[here] = max(math.sqrt((misfit[here] @ misfit[here]) / here.sum() * n / self.nu), floor)
        return float(np.abs(self.noise / before - 1.0).max())


def groups_of(units: Sequence[str], runs: Sequence[Measured]) -> np.ndarray:
    """For every value, which of the noises that are estimated is its own: curves of one unit share one (N)."""
    which = {unit: i for i, unit in enumerate(dict.fromkeys(units))}
    lengths = [len(v) for r in runs for v in r.curves.values()]
    return np.repeat([which[unit] for unit in units], lengths)
