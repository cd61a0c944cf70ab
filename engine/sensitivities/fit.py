"""Parameters from measured curves: least squares with exact gradients (Levenberg and Marquardt's method)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.scene.model import Scene
from engine.scene.overrides import Given, apply, scene_given
from engine.sensitivities.api import sensitivity
from engine.sensitivities.start import checked

ROUNDS = 50
ENOUGH = 1e-9
"""Relative change of the parameters, or of the misfit, below which the search ends."""


@dataclass(frozen=True)
class Fit:
    """values by parameter; deviation: their standard deviations, from the misfit itself; correlation (m × m); misfit: root mean
    square of (model − measured); rounds needed; converged."""

    values: dict[str, float]
    deviation: dict[str, float]
    correlation: np.ndarray
    misfit: float
    rounds: int
    converged: bool


def fit(
    scene: Given,
    parameters: Sequence[str],
    time: np.ndarray,
    measured: Mapping[str, np.ndarray],
    overrides: Mapping[str, Any] | None = None,
    rtol: float = 1e-8,
) -> Fit:
    """Find the parameters with which the scene's outputs follow measured curves best, starting from the scene's own values.

    time (n), s, evenly spaced from 0; measured: curves (n) by column name, all in one unit or scaled to one. Positive parameters
    stay positive. SceneError for wrong names or lengths.
    """

    loaded = scene_given(scene, overrides)
    curves = {k: np.asarray(v, float) for k, v in measured.items()}
    return _Search(loaded, list(parameters), np.asarray(time, float), curves, rtol).run()


class _Search:
    def __init__(self, scene: Scene, names: list[str], time: np.ndarray, measured: dict[str, np.ndarray], rtol: float):
        self.scene, self.names, self.measured, self.rtol = scene, names, measured, rtol
        self.start = np.array(checked(scene, names))
        step = np.diff(time)
        problems = []
        if len(time) < 2 or abs(time[0]) > 1e-12 or np.abs(step - step.mean()).max() > 1e-9 * time[-1]:
            problems.append(Problem("time", "is not evenly spaced from 0", "resample the curves"))
        wrong = {k: len(v) for k, v in measured.items() if len(v) != len(time)}
        problems += [Problem("measured", f"{k} has {n} values for {len(time)} times") for k, n in wrong.items()]
        if problems:
            raise SceneError(problems)
        self.until, self.every = float(time[-1]), float(step.mean())

    def run(self) -> Fit:
        """Damped Gauss–Newton steps, damping by the size of each parameter's own effect."""
        p, damping = self.start, 1e-3
        r, J = self._model(p)
        rounds, converged = 0, False
        while rounds < ROUNDS and not converged:
            rounds += 1
            normal = J.T @ J
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -J.T @ r)
            trial = np.where((p > 0) & (p + step <= 0), 0.5 * p, p + step)
            r1, J1 = self._model(trial)
            if r1 @ r1 <= r @ r * (1 + 1e-14):
                small = np.abs(trial - p) <= ENOUGH * np.abs(trial)
                converged = bool(small.all()) or r @ r - r1 @ r1 <= ENOUGH * (r @ r)
                p, r, J, damping = trial, r1, J1, 0.2 * damping
            else:
                damping *= 8
        return self._result(p, r, J, rounds, converged)

    def _model(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(residuals, their derivatives) over all curves."""
        changed = apply(self.scene, dict(zip(self.names, p.tolist(), strict=True)))
        s = sensitivity(changed, self.names, list(self.measured), self.until, self.every, self.rtol)
        r = np.concatenate([s[k] - v for k, v in self.measured.items()])
        return r, np.vstack([s.derivatives[:, s.names.index(k), :] for k in self.measured])

    def _result(self, p: np.ndarray, r: np.ndarray, J: np.ndarray, rounds: int, converged: bool) -> Fit:
        covariance = np.linalg.inv(J.T @ J) * (r @ r) / max(1, len(r) - len(p))
        sigma = np.sqrt(np.diag(covariance))
        return Fit(
            dict(zip(self.names, p.tolist(), strict=True)), dict(zip(self.names, sigma.tolist(), strict=True)),
            covariance / np.outer(sigma, sigma), float(np.sqrt((r @ r) / len(r))), rounds, converged,
        )
