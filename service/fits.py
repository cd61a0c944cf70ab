"""What a request for a fit is made of, its limits, and the plan it stands for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import Field

from engine.basics.problems import Problem, SceneError
from engine.fits import Candidate, Measured, Trial
from engine.fits.asked import Question, problems_of
from engine.fits.cases import FitPlan, fit_plan
from engine.fits.curves import KEPT
from engine.scene.given import Amounts, names_given
from engine.scene.model import Scene
from service.settings import Limits
from service.ways import Asked, Number, Path, Plain, Text

MOST_RUNS, MOST_PARAMETERS, MOST_CANDIDATES, MOST_TRIALS = 50, 50, 20, 50
MOST_MEASURED = 100_000
"""Values of all measured curves together."""
RTOL = 1e-8
"""Of the runs, where none is given; as ``engine.fit``."""
ALONE = ("reductions", "trajectories", "spacing", "certify", "until", "every", "method", "kernel", "patience", "steps")
"""Fields of a job that say nothing of a fit."""
WAYS = ("over", "cases", "sample", "optimise", "refine")
Values = list[float]
Ends = dict[Path, tuple[Number | None, Number | None]]
Priors = dict[Path, Text]
Noise = float | dict[Plain, float]
BOUNDS: Any = Field(default_factory=dict, max_length=100, description="Low and high end by path, null for none.")
PRIORS: Any = Field(default_factory=dict, max_length=100, description='By path: "normal(mean, deviation)" or "lognormal(…)".')
CHANGES = "Numbers of the scene that were different, by path."
NOISE = "Standard deviation, of all curves or by column, in SI units; null: estimated."


class FitRun(Asked):
    """A measured run."""

    time: Values = Field(min_length=2, max_length=MOST_MEASURED, description="Seconds, evenly spaced from 0.")
    curves: dict[Plain, Values] = Field(min_length=1, max_length=100, description="By column, in SI units: a value for each time.")
    overrides: dict[Path, Any] = Field(default_factory=dict, max_length=100, description=CHANGES)
    noise: Noise | None = Field(None, description=NOISE)
    name: Plain = Field("", description="What it is called; by its place where it has no name.")


class FitCandidate(Asked):
    """A law to compare, or the scene with other changes; fitted numbers, bounds and priors beside those of all."""

    law: Plain = Field("", description="Friction law of all joints that rub; the scene's own where none is named.")
    parameters: list[Path] = Field(default_factory=list, max_length=MOST_PARAMETERS)
    overrides: dict[Path, Any] = Field(default_factory=dict, max_length=100, description="Other changes, first guesses among them.")
    bounds: Ends = BOUNDS
    priors: Priors = PRIORS


class FitTrial(Asked):
    """An experiment that could be made; what is left out is as in the first run."""

    overrides: dict[Path, Any] = Field(default_factory=dict, max_length=100, description=CHANGES)
    outputs: list[Plain] | None = Field(None, min_length=1, max_length=100, description="Columns that would be measured.")
    noise: Noise | None = Field(None, description="Standard deviation with which they would be, of all or by column.")
    until: Number | None = None
    every: Number | None = None


class Fit(Asked):
    """Numbers of the scene from measured runs, with intervals; laws compared; experiments ranked."""

    parameters: list[Path] = Field(default_factory=list, max_length=MOST_PARAMETERS, description="What is looked for, by path.")
    runs: list[FitRun] = Field(min_length=1, max_length=MOST_RUNS)
    own: list[Path] = Field(default_factory=list, max_length=MOST_PARAMETERS, description="Numbers that each run has its own of.")
    bounds: Ends = BOUNDS
    priors: Priors = PRIORS
    level: float = Field(0.95, gt=0, lt=1, description="Of the intervals.")
    intervals: bool = Field(True, description="Whether there are intervals by profile, beside local ones.")
    candidates: dict[Plain, FitCandidate] = Field(
        default_factory=dict, max_length=MOST_CANDIDATES, description="Laws to compare, by a name: a case each."
    )
    trials: dict[Plain, FitTrial] = Field(
        default_factory=dict, max_length=MOST_TRIALS, description="Experiments to rank by what they would tell, by a name."
    )


def question_of(f: Mapping[str, Any], rtol: float | None) -> Question:
    """The question that a request's ``fit``, as plain data, stands for; rtol: of its runs, None for the usual one."""
    runs = [
        Measured(np.array(r["time"], float), {n: np.array(v, float) for n, v in r["curves"].items()}, **_others(r))
        for r in f["runs"]
    ]  # fmt: skip
    laws = {n: Candidate(tuple(c["parameters"]), c["law"], c["overrides"], c["bounds"], c["priors"])
            for n, c in f["candidates"].items()}  # fmt: skip
    trials = {n: Trial(**t) for n, t in f["trials"].items()}
    same = {n: f[n] for n in ("bounds", "priors", "level", "intervals")}
    own = tuple(f["own"])
    return Question(tuple(f["parameters"]), tuple(runs), own, rtol=rtol or RTOL, candidates=laws, trials=trials, **same)


def _others(run: Mapping[str, Any]) -> dict[str, Any]:
    return {n: run[n] for n in ("overrides", "noise", "name")}


def fit_of_request(scene: Scene, asked: Mapping[str, Any], rtol: float | None, wrong: list[Problem], limits: Limits) -> FitPlan:
    """The plan of a request with a fit; SceneError with every problem, ``wrong`` and those of limits included."""
    others = [n for n in WAYS if asked.get(n) is not None]
    problems = [*wrong, *(Problem(n, "it is no part of a fit", "a job of its own for it") for n in others)]
    hint = "leave it out: a fit's runs are as long as what was measured, by methods of its own"
    problems += [Problem(n, "it says nothing of a fit", hint) for n in ALONE if asked.get(n)]
    q = question_of(asked["fit"], rtol)
    problems += [*_too_much(q, limits), *(replace(p, where=f"fit, {p.where}") for p in problems_of(scene, q))]
    if problems:
        raise SceneError(problems)
    return fit_plan(scene, q)


def fit_of_document(scene: Scene, document: Mapping[str, Any], rtol: float | None) -> FitPlan:
    """The plan of a document that was kept."""
    return fit_plan(scene, question_of(document["fit"], rtol))


def _too_much(q: Question, limits: Limits) -> list[Problem]:
    """What exceeds what this server allows."""
    out = []
    values = sum(len(v) for r in q.runs for v in r.curves.values())
    most = len(q.parameters) + max((len(names_given(c.parameters)) for c in q.candidates.values()), default=0)
    fitted = most + len(q.own) * len(q.runs)
    if values > MOST_MEASURED:
        what = f"{values} measured values are more than the {MOST_MEASURED} allowed"
        out.append(Problem("fit.runs", what, "fewer times: what is between them is seldom news"))
    if fitted > MOST_PARAMETERS:
        what = f"{fitted} numbers to look for are more than the {MOST_PARAMETERS} allowed"
        out.append(Problem("fit.parameters", what, "give some, or fit fewer runs at once"))
    if KEPT * values * fitted * 8 > limits.output_bytes:
        what = f"slopes of {values} values by {fitted} numbers are more than the {limits.output_bytes:.3g} bytes allowed"
        out.append(Problem("fit.runs", what, "fewer times, or fewer numbers"))
    if len(q.names) > limits.cases:
        out.append(Problem("fit.candidates", f"{len(q.names)} are more than the {limits.cases} allowed", "fewer at once"))
    times = {f"fit.runs.{i}.time": r.until for i, r in enumerate(q.runs)}
    times |= {f"fit.trials.{n}.until": Amounts().time(t.until, "") for n, t in q.trials.items() if t.until is not None}
    for where, until in times.items():
        if until > limits.duration:
            out.append(Problem(where, f"{until:g} s is longer than the {limits.duration:g} s allowed", "a shorter time"))
    return out
