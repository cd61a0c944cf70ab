"""Quantiles and probabilities of exceeding a bound, of a sample's results, each with an interval.

A quantile lies between two of the sorted values (order statistics) with a probability that depends on their places alone, whatever
the distribution; a share has the exact interval of Clopper and Pearson. A case without a value may be anything: it counts as the
least for lower ends, and as the largest for upper ones, so the intervals hold whatever it would have been.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

import numpy as np

from engine.basics.extras import brought
from engine.batch.indices import CONFIDENCE, Estimate

EVEN = (
    "the cases are spread more evenly than by chance: the intervals are those of as many independent cases, and wider than they "
    "would have to be"
)
EXACT = "the intervals hold for any distribution, with at least the confidence"
USUAL = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Spread:
    """How a result is spread over a sample. quantiles: (probability, estimate); above: (bound, probability that it is exceeded);
    cases: of the sample; missing: those without a value; note: what the intervals mean."""

    of: str
    unit: str
    quantiles: tuple[tuple[float, Estimate], ...]
    above: tuple[tuple[float, Estimate], ...]
    cases: int
    missing: int
    note: str

    def document(self) -> dict[str, Any]:
        """As plain data."""
        plain = {n: getattr(self, n) for n in ("of", "unit", "cases", "missing", "note")} | {"confidence": CONFIDENCE}
        quantiles = [{"probability": p, **asdict(e)} for p, e in self.quantiles]
        return plain | {"quantiles": quantiles, "above": [{"bound": b, **asdict(e)} for b, e in self.above]}


def spread(
    of: str, unit: str, values: np.ndarray, sampling: str, at: Sequence[float] = USUAL, above: Sequence[float] = ()
) -> Spread:
    """Quantiles at probabilities, and probabilities of being above bounds, of values of a sample (NaN: none)."""
    known, missing = np.sort(values[~np.isnan(values)]), int(np.isnan(values).sum())
    quantiles = tuple((p, _quantile(known, missing, p)) for p in at)
    exceeded = tuple((b, _share(int((known > b).sum()), len(known), missing)) for b in above)
    return Spread(of, unit, quantiles, exceeded, len(values), missing, EXACT if sampling == "random" else EVEN)


def _quantile(known: np.ndarray, missing: int, p: float) -> Estimate:
    """The quantile at a probability of sorted values; an end is None where no value bounds it."""
    binomial = brought("scipy.special", "analysis", "an interval").bdtr
    n, tail = len(known) + missing, 0.5 * (1.0 - CONFIDENCE)
    if not len(known):
        return Estimate(None, None, None)
    below = binomial(np.arange(n, dtype=float), n, p)  # probability that at most k of the n cases are below the quantile
    low, high = int(np.searchsorted(below, tail, "right")) - 1, int(np.searchsorted(below, 1.0 - tail, "left"))
    padded = np.concatenate([np.full(missing, -np.inf), known]), np.concatenate([known, np.full(missing, np.inf)])
    ends = padded[0][low] if low >= 0 else -np.inf, padded[1][high] if high < n else np.inf
    return Estimate(float(np.quantile(known, p)), *(float(e) if isfinite(e) else None for e in ends))


def _share(count: int, known: int, missing: int) -> Estimate:
    """The probability of what happened in ``count`` of the known cases."""
    special, n, tail = brought("scipy.special", "analysis", "an interval"), known + missing, 0.5 * (1.0 - CONFIDENCE)
    if not known:
        return Estimate(None, 0.0, 1.0)
    most = count + missing
    low = float(special.betaincinv(count, n - count + 1, tail)) if count else 0.0
    high = float(special.betaincinv(most + 1, n - most, 1.0 - tail)) if most < n else 1.0
    return Estimate(count / known, low, high)
