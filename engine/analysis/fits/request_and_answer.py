"""A complete fit request (measured runs, parameters, models to compare, experiments to rank), its problems, and its answer as
plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import partial
from typing import Any

from trunnion.analysis.fits.bounds_and_priors import check_start, read_bounds_and_priors
from trunnion.analysis.fits.experiment_design import Experiment, propose
from trunnion.analysis.fits.fits_from_plain_data import read_criteria
from trunnion.analysis.fits.measurements import MeasuredRun, normalise_runs
from trunnion.analysis.fits.model_comparison import Candidate, apply_candidate, weigh_models
from trunnion.analysis.fits.model_curves import parameter_names, start_values
from trunnion.analysis.fits.parameter_estimation import fit
from trunnion.analysis.sensitivities.initial_data_derivatives import parameter_problems
from trunnion.analysis.sensitivities.request_checks import check_request
from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import apply
from trunnion.scene.units.python_arguments import Amounts, names_given


@dataclass(frozen=True)
class FitRequest:
    """A request about measured runs. Attributes as for ``fit``, ``compare`` and ``propose``.

    candidates: {name: model}; if empty, one fit of the unchanged scene. trials: {name: experiment}; if empty, no ranking.
    """

    parameters: tuple[str, ...]
    runs: tuple[MeasuredRun, ...]
    own: tuple[str, ...] = ()
    bounds: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    priors: Mapping[str, str] = field(default_factory=dict)
    level: float = 0.95
    intervals: bool = True
    rtol: float = 1e-8
    candidates: Mapping[str, Candidate] = field(default_factory=dict)
    trials: Mapping[str, Experiment] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fits: the names of the candidates, or "" for a single fit of the unchanged scene."""
        return tuple(self.candidates) or ("",)

    def of(self, scene: Scene, name: str) -> tuple[Scene, tuple[str, ...], dict[str, Any]]:
        """(scene, parameters, bounds and priors) of the fit ``name``. Raises SceneError for a wrong law or wrong changes."""
        extra = {"bounds": self.bounds, "priors": self.priors}
        return apply_candidate(scene, self.candidates.get(name, Candidate()), self.parameters, extra)


def request_problems(scene: Scene, q: FitRequest) -> list[Problem]:
    """All problems of a request. No simulation is run."""
    out = [] if 0.0 < q.level < 1.0 else [Problem("level", f"{q.level:g} is not a probability", "such as 0.95")]
    runs, wrong = _collect(lambda: normalise_runs(scene, q.runs), "")
    out += wrong
    for name in q.names:
        said = f"candidate {name}, " if name else ""
        made, wrong = _collect(partial(q.of, scene, name), said)
        out += wrong or _fit_problems(made, q, runs or [], said)
    first = runs[0] if runs and not out else None
    out += [p for name, t in q.trials.items() for p in _experiment_problems(scene, q, t, first, f"trial {name}, ")]
    return list(dict.fromkeys(out))


def _collect(work: Any, said: str) -> tuple[Any, list[Problem]]:
    """(result of ``work``, problems). If ``work`` raises SceneError, the result is None; the places of its problems begin with
    ``said``."""
    try:
        return work(), []
    except SceneError as e:
        return None, [Problem(f"{said}{p.where}", p.what, p.hint) for p in e.problems]


def _fit_problems(
    made: tuple[Scene, tuple[str, ...], dict[str, Any]], q: FitRequest, runs: Sequence[MeasuredRun], said: str
) -> list[Problem]:
    """Problems of one fit, given as ``FitRequest.of`` returns it. runs: the measured runs; empty if the runs themselves have
    problems."""
    scene, names, extra = made
    every = [*names, *q.own]
    twice = [n for n in dict.fromkeys(every) if every.count(n) > 1]
    out = [
        Problem(f"{said}parameters", f"{n} is given twice", "name it once: common to all runs, or separate for each run")
        for n in twice
    ]
    out += [Problem(f"{said}{p.where}", p.what, p.hint) for p in parameter_problems(scene, every)]
    scenes: list[Scene] = []
    for i, r in enumerate(runs or q.runs):
        called = r.name or f"run {i + 1}"
        there, wrong = _collect(partial(apply, scene, dict(r.overrides)) if r.overrides else lambda: scene, f"{said}{called}, ")
        scenes.append(there)
        out += wrong
    if out or not runs:
        return out
    all_names = parameter_names(names, q.own, runs)
    found, wrong = _collect(lambda: read_bounds_and_priors(scene, all_names, extra["bounds"], extra["priors"]), said)
    return wrong or _collect(lambda: check_start(start_values(scenes, names, q.own), found), said)[1]


def _experiment_problems(scene: Scene, q: FitRequest, trial: Experiment, first: MeasuredRun | None, said: str) -> list[Problem]:
    """Problems of an experiment. first: the first measured run; None if the first run itself has problems, which could cause
    problems of the experiment."""
    read = Amounts()
    times = [None if x is None else read.time(x, name) for x, name in ((trial.until, "until"), (trial.every, "every"))]
    changed, wrong = _collect(lambda: apply(scene, dict(trial.overrides)), said)
    wrong += [Problem(f"{said}{p.where}", p.what, p.hint) for p in read.problems]
    if wrong or first is None:
        return wrong
    until, every = (own if own is not None else there for own, there in zip(times, (first.until, first.every), strict=True))
    outputs = list(first.curves) if trial.outputs is None else list(names_given(trial.outputs))
    some = [*q.parameters, *q.own] or [n for c in q.candidates.values() for n in names_given(c.parameters)]
    asked, wrong = _collect(lambda: check_request(changed, some, outputs, until, every, q.rtol), said)
    for c in asked[0] if asked else ():
        given = trial.noise.get(c.name) if isinstance(trial.noise, Mapping) else trial.noise
        if (given is None and c.name not in first.curves) or (given is not None and not 0.0 < given < math.inf):
            wrong.append(Problem(f"{said}noise", f"the measurement error of {c.name} is unknown", "give its standard deviation"))
    return wrong


def answer_fit(scene: Scene, q: FitRequest, name: str) -> dict[str, Any]:
    """One fit, and the experiments ranked at its estimate, as plain data. Raises SceneError or SimulationError if the fit fails."""
    own, names, extra = q.of(scene, name)
    found = fit(own, names, None, None, None, q.rtol, runs=q.runs, own=q.own, level=q.level, intervals=q.intervals, **extra)
    told = found.document()
    try:
        ranked = propose(found, q.trials) if q.trials else ()
    except SceneError as e:  # a valid experiment may become invalid at the estimate
        ranked = ()
        told["notes"] += [f"experiments: {p}" for p in e.problems]
    return {"fit": told, "experiments": [p.document() for p in ranked]}


def combine_answers(q: FitRequest, answers: Mapping[str, Mapping[str, Any]], failed: Mapping[str, str]) -> dict[str, Any]:
    """The answer of the request from the fits so far.

    answers: {name: answer of ``answer_fit``}; failed: {name: reason why there is no fit}. The answer contains ``fit``, ``compared``
    and ``experiments``. ``fit`` is the best candidate by BIC; if None, ``why`` gives the reason. ``compared`` holds the candidates;
    None if there are none. ``experiments`` holds the experiments, best first.
    """
    criteria = {n: read_criteria(a["fit"]["criteria"]) for n, a in answers.items()}
    notes = {n: a["fit"]["notes"] for n, a in answers.items()}
    best, why, compared = next(iter(answers), None), "; ".join(failed.values()), None
    if q.candidates:
        try:
            rows, said = weigh_models(criteria, notes, failed)
            best, why = rows[0].name, ""
            told = [{**c.document(), "fit": answers[c.name]["fit"] if c.name in answers else None} for c in rows]
            compared = {"candidates": told, "notes": list(said)}
        except SimulationError as e:
            why = str(e)
    found = answers[best] if best is not None else {"fit": None, "experiments": []}
    return {"kind": "fit", "fit": found["fit"], "why": why, "compared": compared, "experiments": found["experiments"]}
