"""The request model of a fit, checks of its limits, and its plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import Field

from trunnion.analysis.fits.experiment_design import Experiment
from trunnion.analysis.fits.fits_as_batch_cases import FitPlan, make_fit_plan
from trunnion.analysis.fits.measurements import MeasuredRun
from trunnion.analysis.fits.model_comparison import Candidate
from trunnion.analysis.fits.model_curves import MOST_CACHED
from trunnion.analysis.fits.request_and_answer import FitRequest, request_problems
from trunnion.basics.errors import Problem, raise_problems
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.units.python_arguments import Amounts, names_given
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.base_model_and_studies import Number, Path, PlainText, RequestModel, Text

MOST_RUNS, MOST_PARAMETERS, MOST_CANDIDATES, MOST_TRIALS = 50, 50, 20, 50
MOST_MEASURED = 100_000
"""Largest number of values in all measured curves together."""
RTOL = 1e-8
"""Default tolerance of the runs, as in ``trunnion.fit``."""
ALONE = ("reductions", "trajectories", "spacing", "certify", "until", "every", "method", "kernel", "cpu_limit", "max_steps")
"""Fields of a job's request that a fit does not accept."""
CASE_SOURCES = ("vary", "cases", "sample", "optimise", "refine")
Values = list[float]
Ends = dict[Path, tuple[Number | None, Number | None]]
Priors = dict[Path, Text]
Noise = float | dict[PlainText, float]
BOUNDS: Any = Field(default_factory=dict, max_length=100, description="Lower and upper bound by path; null: no bound.")
PRIORS: Any = Field(default_factory=dict, max_length=100, description='By path: "normal(mean, deviation)" or "lognormal(…)".')
CHANGES = "Changed numbers of the scene, by path."
NOISE = "Standard deviation in SI units, for all curves or by column; null: it is estimated."


class FitRun(RequestModel):
    """A measured run."""

    time: Values = Field(min_length=2, max_length=MOST_MEASURED, description="Seconds, evenly spaced from 0.")
    curves: dict[PlainText, Values] = Field(
        min_length=1, max_length=100, description="Measured values in SI units, by column: one value for each time."
    )
    overrides: dict[Path, Any] = Field(default_factory=dict, max_length=100, description=CHANGES)
    noise: Noise | None = Field(None, description=NOISE)
    name: PlainText = Field("", description="Name of the run; default: its position.")


class FitCandidate(RequestModel):
    """A friction law to compare, or a changed scene. The parameters, bounds and priors of the candidate are added to the
    parameters, bounds and priors of the fit."""

    law: PlainText = Field("", description="Friction law of all joints with friction; default: the scene's.")
    parameters: list[Path] = Field(default_factory=list, max_length=MOST_PARAMETERS)
    overrides: dict[Path, Any] = Field(default_factory=dict, max_length=100, description="Other changes, including first guesses.")
    bounds: Ends = BOUNDS
    priors: Priors = PRIORS


class FitTrial(RequestModel):
    """A possible experiment. Omitted fields have the values of the first run."""

    overrides: dict[Path, Any] = Field(default_factory=dict, max_length=100, description=CHANGES)
    outputs: list[PlainText] | None = Field(None, min_length=1, max_length=100, description="Measured columns.")
    noise: Noise | None = Field(None, description="Standard deviation of the measurements, for all columns or by column.")
    until: Number | None = None
    every: Number | None = None


class Fit(RequestModel):
    """A fit of parameters to measured runs, with confidence intervals. A fit can also compare friction laws and rank
    experiments."""

    parameters: list[Path] = Field(default_factory=list, max_length=MOST_PARAMETERS, description="Fitted numbers, by path.")
    runs: list[FitRun] = Field(min_length=1, max_length=MOST_RUNS)
    own: list[Path] = Field(
        default_factory=list, max_length=MOST_PARAMETERS, description="Fitted numbers that have a separate value for each run."
    )
    bounds: Ends = BOUNDS
    priors: Priors = PRIORS
    level: float = Field(0.95, gt=0, lt=1, description="Confidence level of the intervals.")
    intervals: bool = Field(True, description="Whether to compute profile intervals in addition to the local intervals.")
    candidates: dict[PlainText, FitCandidate] = Field(
        default_factory=dict, max_length=MOST_CANDIDATES, description="Friction laws to compare, by name; each law is a case."
    )
    trials: dict[PlainText, FitTrial] = Field(
        default_factory=dict, max_length=MOST_TRIALS, description="Possible experiments to rank by their information gain, by name."
    )


def make_fit_request(f: Mapping[str, Any], rtol: float | None) -> FitRequest:
    """The fit that the field ``fit`` of a request describes. rtol: tolerance of the runs of the fit; None for the default."""
    curves = [{n: np.array(v, float) for n, v in r["curves"].items()} for r in f["runs"]]
    runs = [MeasuredRun(np.array(r["time"], float), c, r["overrides"], r["noise"], r["name"])
            for r, c in zip(f["runs"], curves, strict=True)]  # fmt: skip
    laws = {n: Candidate(tuple(c["parameters"]), c["law"], c["overrides"], c["bounds"], c["priors"])
            for n, c in f["candidates"].items()}  # fmt: skip
    trials = {n: Experiment(**t) for n, t in f["trials"].items()}
    same = {n: f[n] for n in ("bounds", "priors", "level", "intervals")}
    own = tuple(f["own"])
    return FitRequest(tuple(f["parameters"]), tuple(runs), own, rtol=rtol or RTOL, candidates=laws, trials=trials, **same)


def fit_of_request(scene: Scene, asked: Mapping[str, Any], rtol: float | None, wrong: list[Problem], limits: Limits) -> FitPlan:
    """The plan of a request with a fit. SceneError with all problems, including ``wrong`` and violated limits."""
    others = [n for n in CASE_SOURCES if asked.get(n) is not None]
    problems = [*wrong, *(Problem(n, "a fit does not accept this field", "submit a separate job") for n in others)]
    hint = "omit the field: a fit chooses the method, and its runs last as long as the measurements"
    problems += [Problem(n, "a fit does not accept this field", hint) for n in ALONE if asked.get(n)]
    q = make_fit_request(asked["fit"], rtol)
    problems += [*_limit_problems(q, limits), *(replace(p, where=f"fit, {p.where}") for p in request_problems(scene, q))]
    raise_problems(problems)
    return make_fit_plan(scene, q)


def fit_of_document(scene: Scene, document: Mapping[str, Any], rtol: float | None) -> FitPlan:
    """The plan of a fit from a stored document."""
    return make_fit_plan(scene, make_fit_request(document["fit"], rtol))


def _limit_problems(q: FitRequest, limits: Limits) -> list[Problem]:
    """Problems for the violated limits of the server."""
    out = []
    values = sum(len(v) for r in q.runs for v in r.curves.values())
    most = len(q.parameters) + max((len(names_given(c.parameters)) for c in q.candidates.values()), default=0)
    fitted = most + len(q.own) * len(q.runs)
    if values > MOST_MEASURED:
        what = f"{values} measured values are more than the {MOST_MEASURED} allowed"
        out.append(Problem("fit.runs", what, "give fewer times: neighbouring values add little information"))
    if fitted > MOST_PARAMETERS:
        what = f"{fitted} fitted numbers are more than the {MOST_PARAMETERS} allowed"
        out.append(Problem("fit.parameters", what, "fit fewer numbers, or fewer runs at once"))
    if MOST_CACHED * values * fitted * 8 > limits.output_bytes:
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
