"""Quantiles of a sample's results, and probabilities of exceeding a bound, with intervals.

The interval of a quantile lies between two order statistics. The ranks of these order statistics determine the confidence, for any
distribution. Clopper and Pearson's formula gives the interval of a probability. At the lower end of an interval, a case without a
value counts as the smallest value. At the upper end, the case counts as the largest value. Therefore the intervals are valid for
any value of such a case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.optional_packages import brought
from trunnion.batch.sample_statistics.sobol_indices import CONFIDENCE, Estimate

EVEN = "the intervals are computed for independent cases; the cases are spread more evenly, so the intervals are too wide"
EXACT = "the intervals hold for any distribution, with at least the stated confidence"
USUAL = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Spread:
    """The distribution of a result over a sample.

    Attributes:
        of: the result.
        unit: unit of the result.
        quantiles: (probability, estimate of the quantile).
        above: (bound, estimate of the probability of a value above the bound).
        cases: number of cases.
        missing: number of cases without a value.
        note: meaning of the intervals.
    """

    of: str
    unit: str
    quantiles: tuple[tuple[float, Estimate], ...]
    above: tuple[tuple[float, Estimate], ...]
    cases: int
    missing: int
    note: str

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers."""
        plain = {n: getattr(self, n) for n in ("of", "unit", "cases", "missing", "note")} | {"confidence": CONFIDENCE}
        quantiles = [{"probability": p, **asdict(e)} for p, e in self.quantiles]
        return plain | {"quantiles": quantiles, "above": [{"bound": b, **asdict(e)} for b, e in self.above]}


def spread(
    of: str, unit: str, values: np.ndarray, sampling: str, at: Sequence[float] = USUAL, above: Sequence[float] = ()
) -> Spread:
    """Quantiles at probabilities, and probabilities above bounds, of a sample's values (n; NaN: no value)."""
    known, missing = np.sort(values[~np.isnan(values)]), int(np.isnan(values).sum())
    quantiles = tuple((p, _quantile(known, missing, p)) for p in at)
    exceeded = tuple((b, _share(int((known > b).sum()), len(known), missing)) for b in above)
    return Spread(of, unit, quantiles, exceeded, len(values), missing, EXACT if sampling == "random" else EVEN)


def _quantile(known: np.ndarray, missing: int, p: float) -> Estimate:
    """The quantile of sorted values (n) at a probability. An end of the quantile's interval is None if no value of the sample
    bounds the quantile at this end."""
    binomial = brought("scipy.special", "analysis", "an interval").bdtr
    n, tail = len(known) + missing, 0.5 * (1.0 - CONFIDENCE)
    if not len(known):
        return Estimate(None, None, None)
    below = binomial(np.arange(n, dtype=float), n, p)  # probability that at most k cases are below the quantile, k = 0 … n − 1
    low, high = int(np.searchsorted(below, tail, "right")) - 1, int(np.searchsorted(below, 1.0 - tail, "left"))
    padded = np.concatenate([np.full(missing, -np.inf), known]), np.concatenate([known, np.full(missing, np.inf)])
    ends = padded[0][low] if low >= 0 else -np.inf, padded[1][high] if high < n else np.inf
    return Estimate(float(np.quantile(known, p)), *(float(e) if isfinite(e) else None for e in ends))


def _share(count: int, known: int, missing: int) -> Estimate:
    """The estimated probability of a property that ``count`` of ``known`` cases have."""
    special, n, tail = brought("scipy.special", "analysis", "an interval"), known + missing, 0.5 * (1.0 - CONFIDENCE)
    if not known:
        return Estimate(None, 0.0, 1.0)
    most = count + missing
    low = float(special.betaincinv(count, n - count + 1, tail)) if count else 0.0
    high = float(special.betaincinv(most + 1, n - most, 1.0 - tail)) if most < n else 1.0
    return Estimate(count / known, low, high)
