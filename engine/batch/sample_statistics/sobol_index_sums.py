"""Exact sums over the points of a crossed sample, in any order, and the Sobol indices computed from these sums.

``sobol_indices`` defines the estimators and evaluates them from all rows. A result has one value f for each case of a point. All
estimates follow from the number of points, the sums of f, and the sums of products of two values f. These are kept for each
replicate, because the jackknife leaves out one replicate at a time. Incomplete points are summed separately, with zero for a
missing value. Sums that involve missing values are also kept, so that another value can replace these zeros later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import combinations
from math import prod, sqrt

import numpy as np

from trunnion.batch.cases.sample_points import REPLICATES
from trunnion.batch.sample_statistics import exact_summation
from trunnion.batch.sample_statistics.sobol_indices import FAILED, FLAT, Estimate, Indices, around, assembled, jackknifed, told_of


@lru_cache(maxsize=64)
def pairs(paths: int) -> np.ndarray:
    """The pairs of a point's cases whose products are summed, as case indices (2 × products). All squares come first.

    Case 0 is A. Case 1 + i is A with number i from B. Case 1 + paths + i is B with number i from A. The last case is B.
    """
    a, b = 0, 2 * paths + 1
    found = [(i, i) for i in range(b + 1)] + [(a, b)]
    for i in range(paths):
        found += [(p, q) for p in (a, b) for q in (1 + i, 1 + paths + i)]
    found += [(1 + paths + i, 1 + j) for i in range(paths) for j in range(paths) if i != j]
    return np.array(found).T


@dataclass(frozen=True)
class Points:
    """Sums over points for several results, by replicate.

    Attributes:
        names: the results (r).
        paths: number of varied numbers.
        whole: number of complete points (r × REPLICATES).
        gaps: number of incomplete points (r × REPLICATES).
        sums: sums of values and of products over complete points (r × REPLICATES × places × doubles).
        others: sums over incomplete points, in blocks: values, products, values whose partner is missing, missing values, pairs of
            missing values.
        low: least value of each result (r).
        high: largest value of each result (r).
        missing: for each result, {reason: number of cases without a value}.
    """

    names: tuple[str, ...]
    paths: int
    whole: np.ndarray
    gaps: np.ndarray
    sums: np.ndarray
    others: np.ndarray
    low: np.ndarray
    high: np.ndarray
    missing: tuple[dict[str, int], ...]

    def document(self, of: str, unit: str, paths: tuple[str, ...]) -> Indices:
        """The indices of the result ``of``."""
        return _indices(self, self.names.index(of), of, unit, paths)


def points_of(names: Sequence[str], paths: int, number: np.ndarray, values: np.ndarray, outcome: np.ndarray) -> Points:
    """The sums over points. number (points): indices of the points; values: results × points × cases of a point, NaN for a missing
    value; outcome: points × cases of a point.

    An additional result is 1 for failed cases and 0 for other cases.
    """
    values = np.where((outcome == "done") & (np.abs(values) <= exact_summation.LARGEST), values, np.nan)
    missing = tuple(_missing(v, outcome) for v in values)
    f = np.concatenate([values, (outcome != "done").astype(float)[None]])
    group, m = number % REPLICATES, np.isnan(f)
    gap, known = m.any(axis=2), np.where(m, 0.0, f)
    counts = [np.array([[int(((group == g) & (x == y)).sum()) for g in range(REPLICATES)] for x in gap]) for y in (False, True)]
    p, q = pairs(paths)
    with np.errstate(under="ignore"):
        whole = _joined(_added(_placed(np.where(gap[..., None], 0.0, known), group), p, q))
        others = _filled(_placed(np.where(gap[..., None], known, 0.0), group), _placed(m, group), p, q)
    low, high = np.where(m, np.inf, f).min(axis=(1, 2), initial=np.inf), np.where(m, -np.inf, f).max(axis=(1, 2), initial=-np.inf)
    return Points((*names, FAILED), paths, counts[0], counts[1], whole, others, low, high, (*missing, {}))


def together(some: Sequence[Points]) -> Points:
    """The total of several sums over points."""
    one = some[0]
    missing = tuple(
        {why: sum(s.missing[r].get(why, 0) for s in some) for why in dict.fromkeys(w for s in some for w in s.missing[r])}
        for r in range(len(one.names))
    )
    counts = [np.sum([getattr(s, n) for s in some], axis=0) for n in ("whole", "gaps")]
    both = [exact_summation.added([getattr(s, n) for s in some]) for n in ("sums", "others")]
    low, high = np.min([s.low for s in some], axis=0), np.max([s.high for s in some], axis=0)
    return Points(one.names, one.paths, counts[0], counts[1], both[0], both[1], low, high, missing)


def _missing(values: np.ndarray, outcome: np.ndarray) -> dict[str, int]:
    why, count = np.unique(np.where(outcome == "done", "no value", outcome)[np.isnan(values)].astype(str), return_counts=True)
    return dict(zip(why.tolist(), count.tolist(), strict=True))


def _placed(x: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Points (results × points × places), arranged by replicate (points of a replicate × REPLICATES × results × places), padded
    with zeros."""
    most = int(np.bincount(group, minlength=1).max())
    out = np.zeros((most, REPLICATES, len(x), x.shape[2]))
    for g in range(REPLICATES):
        of = np.flatnonzero(group == g)
        out[: len(of), g] = np.moveaxis(x[:, of], 0, 1)
    return out


def _summed(x: np.ndarray) -> np.ndarray:
    """Exact sums over points (points × REPLICATES × results × places) as expansions (results × REPLICATES × places × doubles)."""
    found = exact_summation.sums(x.reshape(len(x), prod(x.shape[1:])))
    return np.moveaxis(found.reshape(*x.shape[1:], found.shape[1]), 0, 1)


def _added(f: np.ndarray, p: np.ndarray, q: np.ndarray) -> list[np.ndarray]:
    """Exact sums of placed values, and of their products."""
    return [_summed(f), _summed(exact_summation.products(f[..., p], f[..., q]))]


def _filled(f: np.ndarray, m: np.ndarray, p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """``Points.others``. f: values, 0 where missing; m: 1 where missing; p, q: the pairs."""
    if not m.any():
        return np.zeros((f.shape[2], REPLICATES, 2 * f.shape[3] + 3 * len(p), 0))
    forward, backward, both = f[..., p] * m[..., q], f[..., q] * m[..., p], m[..., p] * m[..., q]
    cross = np.concatenate([forward, backward])
    return _joined([*_added(f, p, q), *map(_summed, (cross, m, both))])


def _joined(blocks: list[np.ndarray]) -> np.ndarray:
    """Blocks, concatenated along the axis of places."""
    most = max(b.shape[-1] for b in blocks)
    return np.concatenate([np.pad(b, ((0, 0), (0, 0), (0, 0), (0, most - b.shape[-1]))) for b in blocks], axis=2)


def _indices(points: Points, r: int, of: str, unit: str, paths: tuple[str, ...]) -> Indices:
    """The indices of a result, equal to those of ``sobol_indices.indices`` up to rounding."""
    d, wide = points.paths, 2 * points.paths + 2
    sums, others = exact_summation.fractions(points.sums[r]), exact_summation.fractions(points.others[r])
    n, gaps = int(points.whole[r].sum()), int(points.gaps[r].sum())
    lost = int(sum(others[:, -wide - pairs(d).shape[1] :][:, :wide].sum(axis=0), Fraction()))
    values = (n + gaps) * wide - lost
    total, squares = (sum((x[:, a:b].sum() for x in (sums, others)), Fraction()) for a, b in ((0, wide), (wide, 2 * wide)))
    mean = total / values if values else Fraction()
    deviation = sqrt(max(Fraction(), squares / values - mean * mean)) if values else 0.0
    flat = not values or deviation <= FLAT * max(abs(points.low[r]), abs(points.high[r]))

    def found(filled: float | None) -> list[Estimate]:
        counts, of_group = points.whole[r], sums
        if filled is not None:
            counts, of_group = counts + points.gaps[r], sums + _at(others, Fraction(filled), wide, pairs(d).shape[1])
        there = np.flatnonzero(counts)
        return jackknifed(lambda kept: _numbers(int(counts[there[kept]].sum()), of_group[there[kept]].sum(axis=0), d), there)

    estimates = found(None) if not flat and n >= 2 * REPLICATES else []
    if estimates and gaps:
        for filled in (float(points.low[r]), float(mean), float(points.high[r])):
            estimates = [around(a, b) for a, b in zip(estimates, found(filled), strict=True)]
    notes = told_of(flat, n, n + gaps, values, (n + gaps) * wide)
    return assembled((of, unit, paths), estimates, n + gaps, (n + gaps) * wide, points.missing[r], notes)


def _at(others: np.ndarray, value: Fraction, wide: int, products: int) -> np.ndarray:
    """Sums over incomplete points (REPLICATES × places), with ``value`` in place of each missing value."""
    ends = np.cumsum([wide, products, products, wide])
    f, ff, fm, m, mm = np.split(others, ends, axis=1)
    return np.concatenate([f + value * m, ff + value * fm + value * value * mm], axis=1)


def _numbers(n: int, sums: np.ndarray, d: int) -> np.ndarray:
    """The estimates of ``sobol_indices`` from the sums of numbers and products over n points."""
    wide, (p, q) = 2 * d + 2, pairs(d)
    one = sums[:wide]
    mean = Fraction(float((one[0] + one[-1]) / (2 * n)))
    c = {(int(i), int(j)): s - mean * (one[i] + one[j]) + n * mean * mean for i, j, s in zip(p, q, sums[wide:], strict=True)}
    a, b = 0, wide - 1
    variance = (c[a, a] - 2 * c[a, b] + c[b, b]) / 2
    first, total, second = [], [], []
    for i in range(d):
        ai, bi = 1 + i, 1 + d + i
        first.append(((c[b, ai] - c[a, b]) + (c[a, bi] - c[a, b])) / 2)
        total.append((c[a, a] - 2 * c[a, ai] + c[ai, ai] + c[b, b] - 2 * c[b, bi] + c[bi, bi]) / 4)
    for i, j in combinations(range(d), 2):
        second.append((c[1 + d + i, 1 + j] + c[1 + d + j, 1 + i]) / 2 - c[a, b] - first[i] - first[j])
    shares = [float(x / variance) if variance else float("nan") for x in (*first, *total, *second)]
    return np.array([float(mean), sqrt((c[a, a] + c[b, b]) / (2 * n)), *shares])
