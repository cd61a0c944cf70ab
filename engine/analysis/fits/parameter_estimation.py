"""``fit``: estimates numbers of a scene from measured curves, with confidence intervals."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from trunnion.analysis.fits.bounds_and_priors import read_bounds_and_priors
from trunnion.analysis.fits.identifiability import (
    FLAT,
    FLAT_STEP,
    Spectrum,
    UnidentifiableGroup,
    find_unidentifiable,
    slope_spectrum,
)
from trunnion.analysis.fits.information_criteria import Criteria, compute_criteria, note_correlated_misfits
from trunnion.analysis.fits.least_squares_objective import Objective, noise_groups
from trunnion.analysis.fits.measurements import CurveComparison, MeasuredRun, curve_units, normalise_runs
from trunnion.analysis.fits.model_curves import ModelCurves, start_values
from trunnion.analysis.fits.profile_likelihood import BetterFitFound, Interval, Profiles, threshold
from trunnion.analysis.sensitivities.initial_data_derivatives import parameter_values
from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.json_values import finite
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import Given, list_parameters, scene_given
from trunnion.scene.units.python_arguments import Names, names_given

log = logging.getLogger("trunnion.analysis.fits")
MOST_SEARCHES = 3
"""Largest number of searches. Computing the profiles after a search may find a better fit; a new search then starts there."""


@dataclass(frozen=True)
class Fit:
    """The result of a fit: estimated parameters.

    Attributes:
        values: estimates by parameter, SI units.
        deviation: local standard deviations by parameter, SI units; infinite if the data do not determine the parameter.
        correlation: correlation of the estimates (m × m); NaN for parameters that the data do not determine.
        misfit: root mean square of model − measured over all values, in the curves' SI units.
        rounds: number of trial points of the search.
        converged: whether the search converged.
        notes: notes on failed trials, parameters at their bounds, and groups that the data cannot distinguish.
        level: confidence level of the intervals.
        intervals: confidence intervals by parameter.
        inseparable: groups of parameters that the data cannot distinguish.
        runs: measured and model curves of each run.
        criteria: information criteria, for model comparison.
        units: unit of each parameter.
        solution: the state of the fit at its estimate, as input for ``propose``.
    """

    values: dict[str, float]
    deviation: dict[str, float]
    correlation: np.ndarray
    misfit: float
    rounds: int
    converged: bool
    notes: tuple[str, ...] = ()
    level: float = 0.95
    intervals: dict[str, Interval] = field(default_factory=dict)
    inseparable: tuple[UnidentifiableGroup, ...] = ()
    runs: tuple[CurveComparison, ...] = ()
    criteria: Criteria | None = None
    units: dict[str, str] = field(default_factory=dict)
    solution: FitSolution | None = field(default=None, repr=False, compare=False)

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers for JSON. Infinite numbers become None."""
        return {
            "values": self.values, "units": self.units, "deviation": finite(self.deviation),
            "correlation": finite(self.correlation.tolist()),
            "misfit": self.misfit, "rounds": self.rounds, "converged": self.converged, "level": self.level,
            "noise": {r.name: dict(r.noise) for r in self.runs},
            "intervals": {n: i.document() for n, i in self.intervals.items()},
            "inseparable": [a.document() for a in self.inseparable],
            "criteria": self.criteria.document() if self.criteria else None, "notes": list(self.notes),
        }  # fmt: skip


@dataclass(frozen=True)
class FitSolution:
    """The state of a fit at its estimate: u (m) and the derivatives J ((N + priors) × m). units: units of the measured columns."""

    scene: Scene
    objective: Objective
    u: np.ndarray
    J: np.ndarray
    units: dict[str, str]


def fit(
    scene: Given,
    parameters: Names,
    time: np.ndarray | None = None,
    measured: Mapping[str, np.ndarray] | None = None,
    overrides: Mapping[str, Any] | None = None,
    rtol: float = 1e-8,
    *,
    runs: Sequence[MeasuredRun] = (),
    own: Names = (),
    noise: float | Mapping[str, float] | None = None,
    bounds: Mapping[str, Sequence[Any]] | None = None,
    priors: Mapping[str, str] | None = None,
    level: float = 0.95,
    intervals: bool = True,
) -> Fit:
    """Estimate parameters by weighted least squares from measured curves, starting from the scene's own values.

    If the run of a trial fails, the search continues with a shorter step.

    Args:
        scene: as for ``simulate``.
        parameters: paths of the parameters.
        time: n measured times, s, evenly spaced from 0.
        measured: measured curves (n) by column name, SI units.
        overrides: changes of the scene for all runs, {path: value}.
        rtol: relative tolerance of the runs.
        runs: several measured runs, in place of ``time`` and ``measured``.
        own: paths of parameters with a separate value in each run, such as start values; these are named ``PATH @ RUN``.
        noise: standard deviation of the curves, SI units: one value for all, or {column: value}. By default the noise is estimated,
            with one value for all curves of the same unit.
        bounds: {path: (low, high)}, in addition to the bounds of the scene's numbers; None means no bound.
        priors: {path: "normal(mean, deviation)" or "lognormal(mean, deviation)"}.
        level: confidence level of the intervals, a probability.
        intervals: whether to compute profile-likelihood intervals.

    Returns:
        The estimates.

    Raises:
        SceneError: for wrong names, array lengths and numbers, and for a parameter that does not change any curve.
        SimulationError: if the run with the scene's own values does not reach the last time.
    """
    loaded = scene_given(scene, overrides)
    if not 0.0 < level < 1.0:
        raise SceneError([Problem("level", f"{level:g} is not a probability", "such as 0.95")])
    if (time is None) == (not runs):
        raise SceneError([Problem("runs", "give either time and measured, or runs", "give one of them")])
    if runs and noise is not None:
        raise SceneError([Problem("noise", "is given in addition to runs", "each run has its own noise: MeasuredRun(…, noise=…)")])
    given = list(runs) if time is None else [MeasuredRun(time, measured or {}, {}, noise)]
    objective = make_objective(loaded, names_given(parameters), names_given(own), given, rtol, bounds, priors)
    return solve(loaded, objective, level, intervals)


def make_objective(
    scene: Scene, shared: Sequence[str], own: Sequence[str], runs: Sequence[MeasuredRun], rtol: float,
    bounds: Mapping[str, Sequence[Any]] | None = None, priors: Mapping[str, str] | None = None,
) -> Objective:  # fmt: skip
    """The objective of a fit. SceneError lists every problem."""
    parameter_values(scene, [*shared, *own])
    named = normalise_runs(scene, runs)
    curves = ModelCurves(scene, shared, own, named, rtol)
    start = start_values(curves.scenes, shared, own)
    wanted = read_bounds_and_priors(scene, curves.names, bounds, priors)
    return Objective(curves, wanted, start, noise_groups(curve_units(scene, named), named))


def solve(scene: Scene, objective: Objective, level: float, intervals: bool) -> Fit:
    """Minimise the objective, then compute the intervals and the groups of indistinguishable parameters at the minimum."""
    objective.check_influence()
    u, rounds, notes = objective.start / objective.unit, 0, []
    for again in range(MOST_SEARCHES):
        log.debug("the search%s", ", from a better fit" if again else "")
        u, more, converged = objective.minimise(u)
        rounds += more
        t = threshold(level, objective.nu)
        profiles = Profiles(objective, u, t)
        relative = np.where(np.abs(u) > 1e-6, np.abs(u), 1.0)
        seen = slope_spectrum(profiles.J * relative, len(objective.data), t, objective.curves.exact)
        deviations = seen.deviations * relative
        try:
            found = dict(_intervals(profiles, deviations)) if intervals else {}
            named = _find_groups(objective, profiles, seen, relative)
            break
        except BetterFitFound as better:
            u = better.u
            if again == MOST_SEARCHES - 1:
                found, named = {}, ()
                notes.append(
                    "the search for intervals repeatedly found better fits, so no intervals are given; start nearer to the best fit"
                )
    columns = dict(
        zip((c for r in objective.curves.runs for c in r.curves), curve_units(scene, objective.curves.runs), strict=True)
    )
    solution = FitSolution(scene, objective, profiles.u, profiles.J, columns)
    return _make_fit(solution, profiles, seen, deviations, (rounds, converged, notes, level), found, named)


def _intervals(profiles: Profiles, deviations: np.ndarray) -> Iterator[tuple[int, Interval]]:
    """(index, interval) of every parameter."""
    names = profiles.objective.known.names
    for k, name in enumerate(names):
        log.debug("interval %d of %d, %s", k + 1, len(names), name)
        yield k, profiles.interval(k, float(deviations[k]))


def _find_groups(objective: Objective, profiles: Profiles, seen: Spectrum, relative: np.ndarray) -> tuple[UnidentifiableGroup, ...]:
    """The groups of parameters that the data cannot distinguish."""
    names, u = objective.known.names, profiles.u
    positive = (objective.known.low >= 0.0) & (u > 0.0)

    def flat(k: int) -> bool:
        sides = [u[k] + sign * FLAT_STEP * relative[k] for sign in (-1.0, 1.0)]
        rises = [profiles.rise_at(k, x) for x in sides if objective.low[k] <= x <= objective.high[k]]
        return all(r <= FLAT * profiles.t**2 for r in rises if not math.isnan(r))

    return find_unidentifiable(names, seen, positive, relative * objective.unit, flat)


def _make_fit(
    solution: FitSolution, profiles: Profiles, seen: Spectrum, deviations: np.ndarray, ended: tuple[int, bool, list[str], float],
    found: Mapping[int, Interval], named: tuple[UnidentifiableGroup, ...],
) -> Fit:  # fmt: skip
    objective, u, (rounds, converged, notes, level) = solution.objective, solution.u, ended
    names, unit = objective.known.names, objective.unit
    n = len(objective.data)
    misfit = profiles.r[:n] * objective.noise
    runs = _compare_curves(objective, misfit)
    at_bound = [f"{x} is at its bound {v:g}: its standard deviation is not valid there" for x, v in _at_bounds(objective, u)]
    told = [
        *_summarise_failures(objective.failed),
        *notes,
        *at_bound,
        *(a.describe() for a in named),
        *note_correlated_misfits(runs),
    ]
    units = {p.path: p.unit for p in list_parameters(solution.scene)}
    return Fit(
        dict(zip(names, (u * unit).tolist(), strict=True)), dict(zip(names, (deviations * unit).tolist(), strict=True)),
        _correlation(seen), float(np.sqrt((misfit @ misfit) / n)), rounds, converged, tuple(told), level,
        {names[k]: i for k, i in found.items()}, named, runs,
        compute_criteria(misfit, objective.noise, objective.groups, objective.given, len(names)),
        {x: units[x.partition(" @ ")[0]] for x in names}, solution,
    )  # fmt: skip


def _summarise_failures(failed: list[str]) -> list[str]:
    """Notes on failed runs of the search: the note of a single failure, or the number of failures and the last failure."""
    if len(failed) < 2:
        return failed
    return [
        f"{len(failed)} runs of the search failed, and steps were shortened; the last one: {failed[-1].partition('taken: ')[2]}"
    ]


def _correlation(seen: Spectrum) -> np.ndarray:
    """Correlation matrix of the parameters (m × m); NaN for parameters that the data do not determine."""
    size = np.sqrt(np.diag(seen.covariance))
    size[size == 0.0] = 1.0
    out = seen.covariance / np.outer(size, size)
    unsure = np.isinf(seen.deviations)
    out[unsure, :] = out[:, unsure] = np.nan
    np.fill_diagonal(out, 1.0)
    return out


def _at_bounds(objective: Objective, u: np.ndarray) -> list[tuple[str, float]]:
    """(name, value) of every parameter at a bound."""
    near = 1e-7 * np.maximum(np.abs(u), 1e-3)
    at = (u - objective.low <= near) | (objective.high - u <= near)
    return [(objective.known.names[i], float(u[i] * objective.unit[i])) for i in np.flatnonzero(at)]


def _compare_curves(objective: Objective, misfit: np.ndarray) -> tuple[CurveComparison, ...]:
    out, at = [], 0
    for r in objective.curves.runs:
        model, noise = {}, {}
        for c, v in r.curves.items():
            model[c] = v + misfit[at : at + len(v)]
            noise[c] = float(objective.noise[at])
            at += len(v)
        out.append(CurveComparison(r.name, r.time, dict(r.curves), model, noise))
    return tuple(out)
