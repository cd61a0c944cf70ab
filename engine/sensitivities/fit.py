"""Parameters from measured curves: SciPy's least squares (trust-region reflective, inside bounds) with exact gradients."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine.basics.extras import brought
from engine.basics.problems import Problem, SceneError, SimulationError
from engine.scene.contexts import bound_of
from engine.scene.finding import parse_path
from engine.scene.given import Names, names_given
from engine.scene.model import Scene
from engine.scene.overrides import Given, apply, scene_given
from engine.sensitivities.api import sensitivity
from engine.sensitivities.start import checked

ROUNDS = 50
ENOUGH = 1e-9
"""Relative change of the parameters, or of the sum of squares, below which the search ends."""

NOTHING = 1e-11
"""Change of the curves when a parameter doubles, of their largest value, that is the round-off of a run."""


@dataclass(frozen=True)
class Fit:
    """Fitted parameters. values: by name; deviation: their standard deviations, estimated from the misfit itself; correlation
    (m × m); misfit: root mean square of (model − measured); rounds: how many runs were needed; converged: whether the search
    came to its end; notes: trials that failed on the way, and why."""

    values: dict[str, float]
    deviation: dict[str, float]
    correlation: np.ndarray
    misfit: float
    rounds: int
    converged: bool
    notes: tuple[str, ...] = ()


def fit(
    scene: Given,
    parameters: Names,
    time: np.ndarray,
    measured: Mapping[str, np.ndarray],
    overrides: Mapping[str, Any] | None = None,
    rtol: float = 1e-8,
) -> Fit:
    """Find the parameters with which the scene's outputs follow measured curves best, starting from the scene's own values.

    time (n), s, evenly spaced from 0; measured: curves (n) by column name, all in one unit or scaled to one. Parameters
    stay within the values their numbers may have; a trial that cannot be run shortens the step. SceneError for wrong names or
    lengths and for a parameter that changes nothing; SimulationError when the scene as it is does not run to the last time.
    """
    loaded = scene_given(scene, overrides)
    curves = {k: np.asarray(v, float) for k, v in measured.items()}
    return _Search(loaded, list(names_given(parameters)), np.asarray(time, float), curves, rtol).run()


class _Search:
    """The misfit as a function of the parameters, each in units of its start value; the last evaluation is kept."""

    def __init__(self, scene: Scene, names: list[str], time: np.ndarray, measured: dict[str, np.ndarray], rtol: float):
        self.scene, self.names, self.measured, self.rtol = scene, names, measured, rtol
        self.start = np.array(checked(scene, names))
        self.unit = np.where(self.start == 0.0, 1.0, np.abs(self.start))
        step = np.diff(time)
        problems = []
        if len(time) < 2 or abs(time[0]) > 1e-12 or np.abs(step - step.mean()).max() > 1e-9 * time[-1]:
            problems.append(Problem("time", "is not evenly spaced from 0", "resample the curves"))
        wrong = {k: len(v) for k, v in measured.items() if len(v) != len(time)}
        problems += [Problem("measured", f"{k} has {n} values for {len(time)} times") for k, n in wrong.items()]
        if problems:
            raise SceneError(problems)
        self.until, self.every = float(time[-1]), float(step.mean())
        self.at: np.ndarray | None = None
        self.failed: list[str] = []

    def run(self) -> Fit:
        """The least-squares fit, inside the bounds that the scene's numbers have."""
        least_squares = brought("scipy.optimize", "analysis", "fit").least_squares

        bounds = [bound_of(parse_path(n) or ()) for n in self.names]
        low, high = (np.array([getattr(b, side) for b in bounds]) / self.unit for side in ("least", "most"))
        u = self.start / self.unit
        self._evaluate(u)
        most = max(np.abs(v).max() for v in self.measured.values())
        still = [n for n, c, p in zip(self.names, self.J.T, self.unit, strict=True) if np.abs(c).max() * p <= NOTHING * most]
        if still:
            hint = "leave it out, or measure something it changes"
            raise SceneError([Problem("parameters", f"{n} changes none of the measured curves", hint) for n in still])
        found = least_squares(self._misfit, u, self._slopes, (low, high), "trf", ENOUGH, ENOUGH, None, "jac", max_nfev=ROUNDS)
        self._evaluate(found.x)
        return self._result(found.nfev, found.status > 0)

    def _misfit(self, u: np.ndarray) -> np.ndarray:
        """Residuals of a trial; infinite where its scene cannot be made or run, so that the search shortens its step."""
        try:
            self._evaluate(u)
        except (SceneError, SimulationError) as e:
            values = ", ".join(f"{n} = {v:g}" for n, v in zip(self.names, u * self.unit, strict=True))
            self.failed.append(f"a trial failed, and a shorter step was taken: {values}: {e}")
            return np.full(sum(map(len, self.measured.values())), np.inf)
        return self.r

    def _slopes(self, u: np.ndarray) -> np.ndarray:
        self._evaluate(u)
        return self.J * self.unit

    def _evaluate(self, u: np.ndarray) -> None:
        """Compute the residuals r and their derivatives J by the parameters, over all curves."""
        if self.at is not None and np.array_equal(self.at, u):
            return
        changed = apply(self.scene, dict(zip(self.names, (u * self.unit).tolist(), strict=True)))
        s = sensitivity(changed, self.names, list(self.measured), self.until, self.every, self.rtol)
        self.r = np.concatenate([s[k] - v for k, v in self.measured.items()])
        self.J = np.vstack([s.derivatives[:, s.names.index(k), :] for k in self.measured])
        self.at = u.copy()

    def _result(self, rounds: int, converged: bool) -> Fit:
        assert self.at is not None
        r, size = self.r, np.linalg.norm(self.J, axis=0)
        size[size == 0.0] = 1.0
        scaled = self.J / size
        covariance = np.linalg.pinv(scaled.T @ scaled) / np.outer(size, size) * (r @ r) / max(1, len(r) - len(self.names))
        sigma = np.sqrt(np.diag(covariance))
        by = np.where(sigma == 0.0, 1.0, sigma)
        return Fit(
            dict(zip(self.names, (self.at * self.unit).tolist(), strict=True)), dict(zip(self.names, sigma.tolist(), strict=True)),
            covariance / np.outer(by, by), float(np.sqrt((r @ r) / len(r))), rounds, converged, tuple(self.failed),
        )  # fmt: skip
