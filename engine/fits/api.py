"""``fit``: a scene's numbers from measured curves, with what is sure of them."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.fits.apart import ASIDE, FLAT, Alike, Spectrum, alike, spectrum
from engine.fits.criteria import Criteria, coloured, criteria
from engine.fits.curves import Curves
from engine.fits.known import known
from engine.fits.measured import Measured, measured_runs, units_of
from engine.fits.problem import Objective, groups_of
from engine.fits.profile import Better, Interval, Profiles, threshold
from engine.scene.given import Names, names_given
from engine.scene.model import Scene
from engine.scene.overrides import Given, list_parameters, scene_given
from engine.sensitivities.start import checked

log = logging.getLogger("trunnion.fits")
AGAIN = 3
"""Searches at most, each from the better fit that the profiles of the last met."""


@dataclass(frozen=True)
class Followed:
    """A measured run and the fitted model's curves beside it. name; time (n), s; measured, model: by column (n each); noise: the
    standard deviation of each column, given or estimated."""

    name: str
    time: np.ndarray
    measured: Mapping[str, np.ndarray]
    model: Mapping[str, np.ndarray]
    noise: Mapping[str, float]


@dataclass(frozen=True)
class Fit:
    """Fitted parameters. values: by name; deviation: their local standard deviations, infinite where the data leave them open;
    correlation (m × m), NaN there; misfit: root mean square of (model − measured); rounds: how many runs were needed; converged:
    whether the search came to its end; notes: trials that failed on the way, and why, and what to know; level: of the intervals;
    intervals: by name; inseparable: which parameters the data cannot tell apart; runs: measured and model curves; criteria: for
    comparing laws; units: of the parameters; found: what ``propose`` needs."""

    values: dict[str, float]
    deviation: dict[str, float]
    correlation: np.ndarray
    misfit: float
    rounds: int
    converged: bool
    notes: tuple[str, ...] = ()
    level: float = 0.95
    intervals: dict[str, Interval] = field(default_factory=dict)
    inseparable: tuple[Alike, ...] = ()
    runs: tuple[Followed, ...] = ()
    criteria: Criteria | None = None
    units: dict[str, str] = field(default_factory=dict)
    found: Solved | None = field(default=None, repr=False, compare=False)

    def document(self) -> dict[str, Any]:
        """As plain data, ready for JSON; infinite deviations are None."""
        finite = {n: d if math.isfinite(d) else None for n, d in self.deviation.items()}
        correlation = [[c if math.isfinite(c) else None for c in row] for row in self.correlation.tolist()]
        return {
            "values": self.values, "units": self.units, "deviation": finite, "correlation": correlation,
            "misfit": self.misfit, "rounds": self.rounds, "converged": self.converged, "level": self.level,
            "noise": {r.name: dict(r.noise) for r in self.runs},
            "intervals": {n: i.document() for n, i in self.intervals.items()},
            "inseparable": [a.document() for a in self.inseparable],
            "criteria": self.criteria.document() if self.criteria else None, "notes": list(self.notes),
        }  # fmt: skip


@dataclass(frozen=True)
class Solved:
    """What further questions to a fit need: its scene, objective and estimate (u, and the slopes J by it, (N + priors) × m); units:
    of the measured columns."""

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
    runs: Sequence[Measured] = (),
    own: Names = (),
    noise: float | Mapping[str, float] | None = None,
    bounds: Mapping[str, Sequence[Any]] | None = None,
    priors: Mapping[str, str] | None = None,
    level: float = 0.95,
    intervals: bool = True,
) -> Fit:
    """Find the parameters with which the scene's outputs follow measured curves best, starting from the scene's own values.

    time (n), s, evenly spaced from 0; measured: curves (n) by column name; noise: its standard deviation, for all or by column, or
    left out to be estimated, one for the curves of each unit. In their place ``runs``, several measured at once. own: parameters of
    which each run has a value of its own (named ``PATH @ RUN``), such as its start. Parameters stay within the values their numbers
    may have, and within ``bounds``, {path: (low, high)}; priors: {path: "normal(mean, deviation)" or "lognormal(…)"}. level: of the
    intervals, by profiles unless ``intervals`` is False. A trial that cannot be run shortens the step. SceneError for wrong names,
    lengths and numbers and for a parameter that changes nothing; SimulationError when the scene as it is does not run to the last
    time.
    """
    loaded = scene_given(scene, overrides)
    if not 0.0 < level < 1.0:
        raise SceneError([Problem("level", f"{level:g} is no probability", "such as 0.95")])
    if (time is None) == (not runs):
        raise SceneError([Problem("runs", "either time and measured, or runs", "give one of them")])
    if runs and noise is not None:
        raise SceneError([Problem("noise", "is given beside runs", "each run has its own: Measured(…, noise=…)")])
    given = list(runs) if time is None else [Measured(time, measured or {}, {}, noise)]
    objective = prepared(loaded, names_given(parameters), names_given(own), given, rtol, bounds, priors)
    return solved(loaded, objective, level, intervals)


def prepared(
    scene: Scene, shared: Sequence[str], own: Sequence[str], runs: Sequence[Measured], rtol: float,
    bounds: Mapping[str, Sequence[Any]] | None = None, priors: Mapping[str, str] | None = None,
) -> Objective:  # fmt: skip
    """What is minimised. SceneError with what is wrong."""
    checked(scene, [*shared, *own])
    named = measured_runs(scene, runs)
    curves = Curves(scene, shared, own, named, rtol)
    starts = [dict(zip([*shared, *own], checked(s, [*shared, *own]), strict=True)) for s in curves.scenes]
    start = np.array([*(starts[0][p] for p in shared), *(s[p] for s in starts for p in own)])
    wanted = known(scene, curves.names, bounds, priors)
    return Objective(curves, wanted, start, groups_of(units_of(scene, named), named))


def solved(scene: Scene, objective: Objective, level: float, intervals: bool) -> Fit:
    """Search, and look around what was found."""
    objective.check_moving()
    u, rounds, notes = objective.start / objective.unit, 0, []
    for again in range(AGAIN):
        log.debug("the search%s", ", from a better fit" if again else "")
        u, more, converged = objective.minimise(u)
        rounds += more
        t = threshold(level, objective.nu)
        profiles = Profiles(objective, u, t)
        relative = np.where(np.abs(u) > 1e-6, np.abs(u), 1.0)
        seen = spectrum(profiles.J * relative, len(objective.data), t, objective.curves.exact)
        deviations = seen.deviations * relative
        try:
            found = dict(_intervals(profiles, deviations)) if intervals else {}
            named = _alike(objective, profiles, seen, relative)
            break
        except Better as better:
            u = better.u
            if again == AGAIN - 1:
                found, named = {}, ()
                notes.append("better fits were met again and again while intervals were looked for: there are none; start nearer")
    columns = dict(zip((c for r in objective.curves.runs for c in r.curves), units_of(scene, objective.curves.runs), strict=True))
    solution = Solved(scene, objective, profiles.u, profiles.J, columns)
    return _told(solution, profiles, seen, deviations, (rounds, converged, notes, level), found, named)


def _intervals(profiles: Profiles, deviations: np.ndarray) -> Iterator[tuple[int, Interval]]:
    """The interval of every parameter, by its place."""
    names = profiles.objective.known.names
    for k, name in enumerate(names):
        log.debug("interval %d of %d, %s", k + 1, len(names), name)
        yield k, profiles.interval(k, float(deviations[k]))


def _alike(objective: Objective, profiles: Profiles, seen: Spectrum, relative: np.ndarray) -> tuple[Alike, ...]:
    """The parameters that the data cannot tell apart."""
    names, u = objective.known.names, profiles.u
    positive = (objective.known.low >= 0.0) & (u > 0.0)

    def flat(k: int) -> bool:
        sides = [u[k] + sign * ASIDE * relative[k] for sign in (-1.0, 1.0)]
        rises = [profiles.at(k, x) for x in sides if objective.low[k] <= x <= objective.high[k]]
        return all(r <= FLAT * profiles.t**2 for r in rises if not math.isnan(r))

    return alike(names, seen, positive, relative * objective.unit, flat)


def _told(
    solution: Solved, profiles: Profiles, seen: Spectrum, deviations: np.ndarray, ended: tuple[int, bool, list[str], float],
    found: Mapping[int, Interval], named: tuple[Alike, ...],
) -> Fit:  # fmt: skip
    objective, u, (rounds, converged, notes, level) = solution.objective, solution.u, ended
    names, unit = objective.known.names, objective.unit
    n = len(objective.data)
    misfit = profiles.r[:n] * objective.noise
    runs = _followed(objective, misfit)
    at_bound = [f"{x} is at its bound {v:g}: its local deviation does not hold" for x, v in _at_bounds(objective, u)]
    told = [*_failed(objective.failed), *notes, *at_bound, *(a.told() for a in named), *coloured(runs)]
    units = {p.path: p.unit for p in list_parameters(solution.scene)}
    return Fit(
        dict(zip(names, (u * unit).tolist(), strict=True)), dict(zip(names, (deviations * unit).tolist(), strict=True)),
        _correlation(seen), float(np.sqrt((misfit @ misfit) / n)), rounds, converged, tuple(told), level,
        {names[k]: i for k, i in found.items()}, named, runs,
        criteria(misfit, objective.noise, objective.groups, objective.given, len(names)),
        {x: units[x.partition(" @ ")[0]] for x in names}, solution,
    )  # fmt: skip


def _failed(failed: list[str]) -> list[str]:
    """The trials that failed: one as it is, of many how many they are, and the last."""
    if len(failed) < 2:
        return failed
    return [f"{len(failed)} trials failed, and shorter steps were taken; the last: {failed[-1].partition('taken: ')[2]}"]


def _correlation(seen: Spectrum) -> np.ndarray:
    """The correlation of the parameters (m × m); NaN for those that the data leave open."""
    size = np.sqrt(np.diag(seen.covariance))
    size[size == 0.0] = 1.0
    out = seen.covariance / np.outer(size, size)
    unsure = np.isinf(seen.deviations)
    out[unsure, :] = out[:, unsure] = np.nan
    np.fill_diagonal(out, 1.0)
    return out


def _at_bounds(objective: Objective, u: np.ndarray) -> list[tuple[str, float]]:
    """(name, value) of every parameter that the search left at a bound."""
    near = 1e-7 * np.maximum(np.abs(u), 1e-3)
    at = (u - objective.low <= near) | (objective.high - u <= near)
    return [(objective.known.names[i], float(u[i] * objective.unit[i])) for i in np.flatnonzero(at)]


def _followed(objective: Objective, misfit: np.ndarray) -> tuple[Followed, ...]:
    out, at = [], 0
    for r in objective.curves.runs:
        model, noise = {}, {}
        for c, v in r.curves.items():
            model[c] = v + misfit[at : at + len(v)]
            noise[c] = float(objective.noise[at])
            at += len(v)
        out.append(Followed(r.name, r.time, dict(r.curves), model, noise))
    return tuple(out)
