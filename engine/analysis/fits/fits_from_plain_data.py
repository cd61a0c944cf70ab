"""Reads fits, model comparisons and rankings back from their plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from trunnion.analysis.fits.experiment_design import RankedExperiment
from trunnion.analysis.fits.identifiability import UnidentifiableGroup
from trunnion.analysis.fits.information_criteria import Criteria
from trunnion.analysis.fits.measurements import CurveComparison
from trunnion.analysis.fits.model_comparison import ModelComparison, ModelScore
from trunnion.analysis.fits.parameter_estimation import Fit
from trunnion.analysis.fits.profile_likelihood import Interval


def read_fit(d: Mapping[str, Any]) -> Fit:
    """A fit from its document. The document contains no curves."""
    criteria = read_criteria(d["criteria"]) if d["criteria"] else None
    runs = tuple(CurveComparison(name, np.zeros(0), {}, {}, noise) for name, noise in d["noise"].items())
    intervals = {n: _read_interval(i) for n, i in d["intervals"].items()}
    correlation = np.array([[math.nan if c is None else c for c in row] for row in d["correlation"]])
    return Fit(
        d["values"], _read_floats(d["deviation"]), correlation, d["misfit"], d["rounds"], d["converged"], tuple(d["notes"]),
        d["level"], intervals, tuple(map(_read_group, d["inseparable"])), runs, criteria, d["units"],
    )  # fmt: skip


def read_comparison(d: Mapping[str, Any]) -> ModelComparison:
    """A model comparison from its document."""
    return ModelComparison(tuple(map(_read_score, d["candidates"])), tuple(d["notes"]))


def read_ranking(d: Sequence[Mapping[str, Any]]) -> tuple[RankedExperiment, ...]:
    """A ranking of experiments from its documents."""
    return tuple(
        RankedExperiment(p["name"], -math.inf if p["gain"] is None else p["gain"], _read_floats(p["deviation"]), p["why"])
        for p in d
    )


def read_criteria(d: Mapping[str, Any]) -> Criteria:
    """Criteria from a document."""
    return Criteria(**{k: math.inf if v is None else v for k, v in d.items()})  # type: ignore[arg-type]


def _read_floats(d: Mapping[str, float | None]) -> dict[str, float]:
    """Numbers by name; None becomes infinity."""
    return {n: math.inf if v is None else v for n, v in d.items()}


def _read_interval(d: Mapping[str, Any]) -> Interval:
    local = tuple(side if x is None else x for x, side in zip(d["local"], (-math.inf, math.inf), strict=True))
    profile = (np.array(d["profile"][n], float) for n in ("values", "rises"))
    return Interval(d["low"], d["high"], d["low_end"], d["high_end"], local, *profile)  # type: ignore[arg-type]


def _read_group(d: Mapping[str, Any]) -> UnidentifiableGroup:
    determined = tuple((tuple(c["exponents"]), c["deviation"]) for c in d["determined"])
    return UnidentifiableGroup(tuple(d["names"]), determined, d["product"], d["exact"], d["confirmed"])


def _read_score(d: Mapping[str, Any]) -> ModelScore:
    by = _read_floats({n: d[n] for n in ("worse_by_bic", "worse_by_aicc")})
    return ModelScore(d["name"], read_fit(d["fit"]) if d["fit"] else None, weight=d["weight"] or 0.0, why=d["why"], **by)
