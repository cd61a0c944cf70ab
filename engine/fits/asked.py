"""A fit as it is asked for whole, before anything is run: what is measured, what is looked for, laws to compare, experiments to
rank; every mistake in it at once, and what it comes to as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError, SimulationError
from engine.fits.api import fit
from engine.fits.evidence import Candidate, of_candidate, weighed
from engine.fits.experiments import Trial, propose
from engine.fits.known import OF_RUN, inside, known
from engine.fits.measured import Measured, measured_runs
from engine.fits.told import criteria_of
from engine.scene.given import Amounts, names_given
from engine.scene.model import Scene
from engine.scene.overrides import apply
from engine.sensitivities.asked import checked_request
from engine.sensitivities.start import checked, parameter_problems


@dataclass(frozen=True)
class Question:
    """What is asked of measured runs; all as for ``fit``, ``compare`` (candidates by name; none: one fit of the scene as it is) and
    ``propose`` (trials by name; none: no experiments are ranked)."""

    parameters: tuple[str, ...]
    runs: tuple[Measured, ...]
    own: tuple[str, ...] = ()
    bounds: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    priors: Mapping[str, str] = field(default_factory=dict)
    level: float = 0.95
    intervals: bool = True
    rtol: float = 1e-8
    candidates: Mapping[str, Candidate] = field(default_factory=dict)
    trials: Mapping[str, Trial] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the fits that are made: the candidates', or "" for one of the scene as it is."""
        return tuple(self.candidates) or ("",)

    def of(self, scene: Scene, name: str) -> tuple[Scene, tuple[str, ...], dict[str, Any]]:
        """(scene, names of what is fitted, bounds and priors) of a fit; SceneError with what is wrong with its law and changes."""
        extra = {"bounds": self.bounds, "priors": self.priors}
        return of_candidate(scene, self.candidates.get(name, Candidate()), self.parameters, extra)


def problems_of(scene: Scene, q: Question) -> list[Problem]:
    """Everything that is wrong with a question; nothing is run."""
    out = [] if 0.0 < q.level < 1.0 else [Problem("level", f"{q.level:g} is no probability", "such as 0.95")]
    runs, wrong = _tried(lambda: measured_runs(scene, q.runs), "")
    out += wrong
    for name in q.names:
        said = f"candidate {name}, " if name else ""
        made, wrong = _tried(partial(q.of, scene, name), said)
        out += wrong or _of_fit(made, q, runs or [], said)
    first = runs[0] if runs and not out else None
    out += [p for name, t in q.trials.items() for p in _of_trial(scene, q, t, first, f"trial {name}, ")]
    return list(dict.fromkeys(out))


def _tried(work: Any, said: str) -> tuple[Any, list[Problem]]:
    """(what some work comes to, None where it is refused; what is wrong, with its place)."""
    try:
        return work(), []
    except SceneError as e:
        return None, [Problem(f"{said}{p.where}", p.what, p.hint) for p in e.problems]


def _of_fit(made: tuple[Scene, tuple[str, ...], dict[str, Any]], q: Question, runs: Sequence[Measured], said: str) -> list[Problem]:
    """What is wrong with one of its fits, as ``Question.of`` has it. runs: none where they are wrong."""
    scene, names, extra = made
    every = [*names, *q.own]
    twice = [n for n in dict.fromkeys(every) if every.count(n) > 1]
    out = [Problem(f"{said}parameters", f"{n} is given twice", "name it once, for all runs or as each run's own") for n in twice]
    out += [Problem(f"{said}{p.where}", p.what, p.hint) for p in parameter_problems(scene, every)]
    scenes: list[Scene] = []
    for i, r in enumerate(runs or q.runs):
        called = r.name or f"run {i + 1}"
        there, wrong = _tried(partial(apply, scene, dict(r.overrides)) if r.overrides else lambda: scene, f"{said}{called}, ")
        scenes.append(there)
        out += wrong
    if out or not runs:
        return out
    all_names = [*names, *(f"{p}{OF_RUN}{r.name}" for r in runs for p in q.own)]
    found, wrong = _tried(lambda: known(scene, all_names, extra["bounds"], extra["priors"]), said)
    if wrong:
        return wrong
    starts = [dict(zip(every, checked(s, every), strict=True)) for s in scenes]
    values = np.array([*(starts[0][p] for p in names), *(s[p] for s in starts for p in q.own)])
    return _tried(lambda: inside(values, found), said)[1]


def _of_trial(scene: Scene, q: Question, trial: Trial, first: Measured | None, said: str) -> list[Problem]:
    """What is wrong with an experiment. first: the first measured run, None where something else is wrong, which may be why."""
    read = Amounts()
    times = [None if x is None else read.time(x, name) for x, name in ((trial.until, "until"), (trial.every, "every"))]
    changed, wrong = _tried(lambda: apply(scene, dict(trial.overrides)), said)
    wrong += [Problem(f"{said}{p.where}", p.what, p.hint) for p in read.problems]
    if wrong or first is None:
        return wrong
    until, every = (own if own is not None else there for own, there in zip(times, (first.until, first.every), strict=True))
    outputs = list(first.curves) if trial.outputs is None else list(names_given(trial.outputs))
    some = [*q.parameters, *q.own] or [n for c in q.candidates.values() for n in names_given(c.parameters)]
    asked, wrong = _tried(lambda: checked_request(changed, some, outputs, until, every, q.rtol), said)
    for c in asked[0] if asked else ():
        given = trial.noise.get(c.name) if isinstance(trial.noise, Mapping) else trial.noise
        if (given is None and c.name not in first.curves) or (given is not None and not 0.0 < given < math.inf):
            wrong.append(Problem(f"{said}noise", f"nothing says how exactly {c.name} is measured", "give its standard deviation"))
    return wrong


def answered(scene: Scene, q: Question, name: str) -> dict[str, Any]:
    """One of its fits and the experiments ranked by it, as plain data. SceneError or SimulationError where it cannot be made."""
    own, names, extra = q.of(scene, name)
    found = fit(own, names, None, None, None, q.rtol, runs=q.runs, own=q.own, level=q.level, intervals=q.intervals, **extra)
    told = found.document()
    try:
        ranked = propose(found, q.trials) if q.trials else ()
    except SceneError as e:  # at the estimate, of which nobody knew before
        ranked = ()
        told["notes"] += [f"experiments: {p}" for p in e.problems]
    return {"fit": told, "experiments": [p.document() for p in ranked]}


def together(q: Question, answers: Mapping[str, Mapping[str, Any]], failed: Mapping[str, str]) -> dict[str, Any]:
    """What a question comes to so far. answers: of the fits there are, as ``answered`` gives them; failed: why others are none.

    fit: the fit, of candidates the best by BIC (None: there is none, why says why); compared: the candidates, as ``compare`` tells
    them (None where none were given); experiments: those ranked by that fit, the best first."""
    criteria = {n: criteria_of(a["fit"]["criteria"]) for n, a in answers.items()}
    notes = {n: a["fit"]["notes"] for n, a in answers.items()}
    best, why, compared = next(iter(answers), None), "; ".join(failed.values()), None
    if q.candidates:
        try:
            rows, said = weighed(criteria, notes, failed)
            best, why = rows[0].name, ""
            told = [{**c.document(), "fit": answers[c.name]["fit"] if c.name in answers else None} for c in rows]
            compared = {"candidates": told, "notes": list(said)}
        except SimulationError as e:
            why = str(e)
    found = answers[best] if best is not None else {"fit": None, "experiments": []}
    return {"kind": "fit", "fit": found["fit"], "why": why, "compared": compared, "experiments": found["experiments"]}
