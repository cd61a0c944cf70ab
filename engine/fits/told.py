"""Fits, comparisons and rankings from their documents, to be told as those that were just made."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from engine.fits.apart import Alike
from engine.fits.api import Fit, Followed
from engine.fits.criteria import Criteria
from engine.fits.evidence import Compared, Evidence
from engine.fits.experiments import Proposal
from engine.fits.profile import Interval


def fit_of(d: Mapping[str, Any]) -> Fit:
    """The fit that a document is of; without curves, which it has not."""
    criteria = criteria_of(d["criteria"]) if d["criteria"] else None
    runs = tuple(Followed(name, np.zeros(0), {}, {}, noise) for name, noise in d["noise"].items())
    intervals = {n: _interval(i) for n, i in d["intervals"].items()}
    correlation = np.array([[math.nan if c is None else c for c in row] for row in d["correlation"]])
    return Fit(
        d["values"], _floats(d["deviation"]), correlation, d["misfit"], d["rounds"], d["converged"], tuple(d["notes"]), d["level"],
        intervals, tuple(map(_alike, d["inseparable"])), runs, criteria, d["units"],
    )  # fmt: skip


def evidence_of(d: Mapping[str, Any]) -> Evidence:
    """The comparison that a document is of."""
    return Evidence(tuple(map(_compared, d["candidates"])), tuple(d["notes"]))


def proposals_of(d: Sequence[Mapping[str, Any]]) -> tuple[Proposal, ...]:
    """The ranking that documents are of."""
    return tuple(Proposal(p["name"], -math.inf if p["gain"] is None else p["gain"], _floats(p["deviation"]), p["why"]) for p in d)


def criteria_of(d: Mapping[str, Any]) -> Criteria:
    """Criteria from their document."""
    return Criteria(**{k: math.inf if v is None else v for k, v in d.items()})  # type: ignore[arg-type]


def _floats(d: Mapping[str, float | None]) -> dict[str, float]:
    """Numbers by name; what was infinite is so again."""
    return {n: math.inf if v is None else v for n, v in d.items()}


def _interval(d: Mapping[str, Any]) -> Interval:
    local = tuple(side if x is None else x for x, side in zip(d["local"], (-math.inf, math.inf), strict=True))
    profile = (np.array(d["profile"][n], float) for n in ("values", "rises"))
    return Interval(d["low"], d["high"], d["low_end"], d["high_end"], local, *profile)  # type: ignore[arg-type]


def _alike(d: Mapping[str, Any]) -> Alike:
    determined = tuple((tuple(c["exponents"]), c["deviation"]) for c in d["determined"])
    return Alike(tuple(d["names"]), determined, d["product"], d["exact"], d["confirmed"])


def _compared(d: Mapping[str, Any]) -> Compared:
    by = _floats({n: d[n] for n in ("worse_by_bic", "worse_by_aicc")})
    return Compared(d["name"], fit_of(d["fit"]) if d["fit"] else None, weight=d["weight"] or 0.0, why=d["why"], **by)
