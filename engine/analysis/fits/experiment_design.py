"""Experiment design: ranks experiments by the information that they would add about the parameters of a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, field
from typing import Any

import numpy as np

from trunnion.analysis.fits.parameter_estimation import Fit
from trunnion.analysis.sensitivities.sensitivity import sensitivity
from trunnion.basics.errors import Problem, SceneError, SimulationError, raise_problems
from trunnion.basics.json_values import finite
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.overrides import apply
from trunnion.scene.units.python_arguments import Amounts, Names, names_given


@dataclass(frozen=True)
class Experiment:
    """A possible experiment. If an attribute has no value, the value of the fit's first run applies.

    Attributes:
        overrides: changes of the scene, {path: value}.
        outputs: patterns of the measured columns.
        noise: standard deviation of the curves in SI units: one value for all curves, or {column: value}.
        until: end time, s.
        every: spacing of the measured times, s.
    """

    overrides: Mapping[str, Any] = field(default_factory=dict)
    outputs: Names | None = None
    noise: float | Mapping[str, float] | None = None
    until: float | str | None = None
    every: float | str | None = None


@dataclass(frozen=True)
class RankedExperiment:
    """A possible experiment and the information that it would add.

    Attributes:
        name: name of the experiment.
        gain: information, bits: log2 of the ratio of the parameters' confidence volumes before and after the experiment; −∞ if
            the experiment cannot be simulated.
        deviation: local standard deviation of each parameter after the experiment, in the parameter's SI unit.
        why: the reason why the experiment cannot be simulated; "" if there is none.
    """

    name: str
    gain: float
    deviation: Mapping[str, float]
    why: str = ""

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers. Infinite numbers become None."""
        return finite(asdict(self))


def propose(found: Fit, trials: Mapping[str, Experiment | Mapping[str, Any]]) -> tuple[RankedExperiment, ...]:
    """Rank experiments by their D-optimal gain at the estimate of a fit, best first.

    The gain concerns the parameters that all runs share. A parameter with a separate value in each run would need to be estimated
    from the new run as well. The function assumes, for each parameter, a prior whose standard deviation is the parameter's
    magnitude. The gain is therefore finite even if the data do not determine a parameter.

    Args:
        found: the fit.
        trials: {name: experiment}; a mapping of overrides can stand for an experiment.

    Returns:
        The experiments with their gains, best first.

    Raises:
        SceneError: lists every problem of every experiment.
    """
    asked = {n: t if isinstance(t, Experiment) else Experiment(t) for n, t in trials.items()}
    if not asked:
        raise SceneError([Problem("trials", "no trial is given", 'such as {"from higher": {"joints.pivot.start.q": "120 deg"}}')])
    assert found.solution is not None
    objective = found.solution.objective
    shared = len(objective.curves.shared)
    unit = _parameter_sizes(found)
    now = _schur_complement(found.solution.J.T @ found.solution.J * np.outer(unit, unit), shared) + np.eye(shared)
    out, problems = [], []
    for name, trial in asked.items():
        try:
            out.append(_evaluate(name, found, trial, now))
        except SceneError as e:
            problems += [Problem(f"trial {name}, {p.where}", p.what, p.hint) for p in e.problems]
        except SimulationError as e:
            out.append(RankedExperiment(name, -math.inf, {}, str(e)))
    raise_problems(problems)
    return tuple(sorted(out, key=lambda p: -p.gain))


def _parameter_sizes(found: Fit) -> np.ndarray:
    """Magnitude of every parameter (m), in units of its start value; 1 for parameters near zero."""
    assert found.solution is not None
    u = np.abs(found.solution.u)
    return np.where(u > 1e-6, u, 1.0)


def _schur_complement(M: np.ndarray, shared: int) -> np.ndarray:
    """The information matrix of the first ``shared`` parameters, if the other parameters are estimated as well."""
    A, B, C = M[:shared, :shared], M[:shared, shared:], M[shared:, shared:]
    return A - B @ np.linalg.pinv(C) @ B.T if C.size else A


def _evaluate(name: str, found: Fit, trial: Experiment, now: np.ndarray) -> RankedExperiment:
    solved = found.solution
    assert solved is not None
    curves, objective, first = solved.objective.curves, solved.objective, found.runs[0]
    read = Amounts()
    until = float(first.time[-1]) if trial.until is None else read.time(trial.until, "until")
    every = float(first.time[1]) if trial.every is None else read.time(trial.every, "every")
    read.end()
    paths, shared = [*curves.shared, *curves.own], len(curves.shared)
    scene = apply(solved.scene, {p: found.values[p] for p in curves.shared} | dict(trial.overrides))
    outputs = list(first.measured) if trial.outputs is None else list(names_given(trial.outputs))
    s = sensitivity(scene, paths, outputs, until, every, curves.rtol)
    noise = np.array([_noise_of(c, trial, first.noise) for c in s.names])
    sizes = _parameter_sizes(found)[: len(paths)] * objective.unit[: len(paths)]
    J = (s.derivatives / noise[None, :, None]).reshape(-1, len(paths)) * sizes
    after = now + _schur_complement(J.T @ J, shared)
    gain = 0.5 * (np.linalg.slogdet(after)[1] - np.linalg.slogdet(now)[1]) / math.log(2.0)
    deviation = np.sqrt(np.diag(np.linalg.inv(after))) * sizes[:shared]
    return RankedExperiment(name, float(gain), dict(zip(curves.shared, deviation.tolist(), strict=True)))


def _noise_of(column: str, trial: Experiment, known: Mapping[str, float]) -> float:
    """Standard deviation with which an experiment measures a column. Raises SceneError if the deviation is unknown."""
    given = trial.noise.get(column) if isinstance(trial.noise, Mapping) else trial.noise
    found = known.get(column) if given is None else given
    if found is None or not found > 0.0:
        raise SceneError([Problem("noise", f"the measurement error of {column} is unknown", "give its standard deviation")])
    return float(found)
