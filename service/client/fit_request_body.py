"""Converts arrays, candidates and trials of a fit to the field ``fit`` of a request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

from trunnion.analysis.fits.experiment_design import Experiment
from trunnion.analysis.fits.measurements import MeasuredRun
from trunnion.analysis.fits.model_comparison import Candidate
from trunnion.basics.errors import Problem, SceneError
from trunnion.scene.units.python_arguments import Names, names_given

FIELDS = ("noise", "runs", "own", "bounds", "priors", "level", "intervals", "candidates", "trials")
"""Names of the arguments of a fit other than ``parameters``, ``time`` and ``measured``."""


def fit_body(
    parameters: Names,
    time: Any = None,
    measured: Mapping[str, Any] | None = None,
    *,
    noise: float | Mapping[str, float] | None = None,
    runs: Sequence[MeasuredRun] = (),
    own: Names = (),
    candidates: Mapping[str, Candidate | Names] | None = None,
    trials: Mapping[str, Experiment | Mapping[str, Any]] | None = None,
    **more: Any,
) -> dict[str, Any]:
    """The field ``fit`` of a request. The arguments are the arguments of ``trunnion.fit``, ``trunnion.compare`` (candidates) and
    ``trunnion.propose`` (trials). more: bounds, priors, level, intervals. SceneError unless exactly one of ``time`` and ``runs`` is
    given."""
    if (time is None) == (not runs):
        raise SceneError([Problem("runs", "give either time and measured, or runs", "give one")])
    given = list(runs) if time is None else [MeasuredRun(time, measured or {}, {}, noise)]
    laws = {n: c if isinstance(c, Candidate) else Candidate(c, n) for n, c in (candidates or {}).items()}
    tries = {n: t if isinstance(t, Experiment) else Experiment(t) for n, t in (trials or {}).items()}
    return {
        "parameters": list(names_given(parameters)), "own": list(names_given(own)), "runs": [_run(r) for r in given],
        "candidates": {n: asdict(c) | {"parameters": list(names_given(c.parameters))} for n, c in laws.items()},
        "trials": {n: asdict(t) | {"outputs": t.outputs and list(names_given(t.outputs))} for n, t in tries.items()},
        **{n: v for n, v in more.items() if v is not None},
    }  # fmt: skip


def _run(r: MeasuredRun) -> dict[str, Any]:
    noise = dict(r.noise) if isinstance(r.noise, Mapping) else r.noise
    curves = {n: _numbers(v) for n, v in r.curves.items()}
    return {"time": _numbers(r.time), "curves": curves, "overrides": dict(r.overrides), "noise": noise, "name": r.name}


def _numbers(values: Any) -> list[float | None]:
    """The numbers for JSON. Non-finite numbers become null, which the server reports as a problem with its place."""
    return [x if isfinite(x) else None for x in map(float, values)]
