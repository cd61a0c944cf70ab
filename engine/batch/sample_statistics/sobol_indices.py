"""Sobol indices of a crossed sample (``sampling="saltelli"``), with intervals.

f_A and f_B are the results of samples A and B. f_Ai is the result of A with number i taken from B. f_Bi is the result of B with
number i taken from A. ⟨⟩ is the mean over all points. Both halves of the sample are used (Saltelli et al. 2010):

    first S_i = ½ ⟨f_B (f_Ai − f_A) + f_A (f_Bi − f_B)⟩ / V
    total T_i = ¼ ⟨(f_A − f_Ai)² + (f_B − f_Bi)²⟩ / V (Jansen 1999)
    second S_ij = ⟨½ (f_Bi f_Aj + f_Ai f_Bj) − f_A f_B⟩ / V − S_i − S_j
    V = ½ ⟨(f_A − f_B)²⟩

For any points, the index of the only influential number is exactly 1. The index of a number without influence is exactly 0.

Intervals: the points belong to REPLICATES independent scrambles. The jackknife leaves out one scramble at a time, and Student's t
gives an interval from the differences. The points of a scramble are evenly spread, so they are not independent. Leaving out whole
scrambles makes the intervals valid.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, field
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.optional_packages import brought
from trunnion.batch.cases.sample_points import REPLICATES

if TYPE_CHECKING:
    import pyarrow

CONFIDENCE = 0.95
FAILED = "failed"
"""Name of an additional result if cases fail: 1 for a case whose outcome is not ``done``, otherwise 0."""
FLAT = 1e-12
"""A standard deviation below this multiple of the result's largest value is only rounding error. Such a result does not vary."""


@dataclass(frozen=True)
class Estimate:
    """A number with its 95 % confidence interval. All attributes are None if the number cannot be estimated."""

    value: float | None
    low: float | None
    high: float | None


NOTHING = Estimate(None, None, None)
Told = tuple[str, str, tuple[str, ...]]
"""A result, its unit and the varied paths."""


@dataclass(frozen=True)
class Indices:
    """Sobol indices of a result.

    Attributes:
        of: the result.
        unit: unit of the result.
        paths: the varied numbers (d).
        first: for each number, the share of the variance that vanishes if this number is known (d).
        total: for each number, the share of the variance that remains if all other numbers are known (d).
        second: {pair of paths: share of the variance from the interaction of the two numbers}.
        mean: mean of the result.
        deviation: standard deviation of the result.
        points: number of points.
        cases: number of cases.
        missing: {reason: number of cases without a value}; the reason is the outcome of the case, or ``no value``.
        notes: limits of the estimates.
    """

    of: str
    unit: str
    paths: tuple[str, ...]
    first: tuple[Estimate, ...]
    total: tuple[Estimate, ...]
    second: dict[tuple[str, str], Estimate]
    mean: Estimate
    deviation: Estimate
    points: int
    cases: int
    missing: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers."""
        second = [{"paths": list(pair), **asdict(e)} for pair, e in self.second.items()]
        plain = {n: getattr(self, n) for n in ("of", "unit", "points", "cases", "missing")}
        of = {n: zip(self.paths, getattr(self, n), strict=True) for n in ("first", "total")}
        both = {n: [{"path": p, **asdict(e)} for p, e in pairs] for n, pairs in of.items()}
        spread = {n: asdict(getattr(self, n)) for n in ("mean", "deviation")}
        return plain | spread | both | {"second": second, "confidence": CONFIDENCE, "notes": list(self.notes)}


def indices(table: pyarrow.Table, paths: Sequence[str], names: Sequence[str], units: Mapping[str, str]) -> list[Indices]:
    """The Sobol indices of results (columns of the table of a crossed sample), and of failures if cases fail.

    Rows must be in the order of cases. Incomplete points at the end are ignored. SceneError for too few points.
    """
    each = 2 * len(paths) + 2
    cases = table["case"].to_numpy()
    n = int(np.argmin(cases == np.arange(len(cases)))) if len(cases) and (cases != np.arange(len(cases))).any() else len(cases)
    points = n // each
    if points < 2 * REPLICATES:
        what = f"{points} points of the crossed sample have been run; {2 * REPLICATES} are needed"
        raise SceneError([Problem("indices", what, "wait for more points, or raise count")])
    table = table.slice(0, points * each)
    outcome = np.array(table["outcome"].to_pylist(), object)
    out = []
    for name in names:
        values = table[name].to_numpy().astype(float)
        values[outcome != "done"] = np.nan
        told = (name, units.get(name, ""), tuple(paths))
        out.append(_indices(told, values.reshape(points, each), _missing(values, outcome)))
    if (outcome != "done").any():
        out.append(_indices((FAILED, "1", tuple(paths)), (outcome != "done").astype(float).reshape(points, each), {}))
    return out


def _missing(values: np.ndarray, outcome: np.ndarray) -> dict[str, int]:
    """{reason: number of cases without a value}."""
    why = np.where(outcome == "done", "no value", outcome)[np.isnan(values)]
    return {str(w): int((why == w).sum()) for w in dict.fromkeys(why.tolist())}


def _indices(told: Told, f: np.ndarray, missing: dict[str, int]) -> Indices:
    """The Sobol indices of one result. f: values of the result, one row per point, one column per case of the point; NaN: no
    value."""
    whole = ~np.isnan(f).any(axis=1)
    known = f[~np.isnan(f)]
    found: list[Estimate] = []
    flat = not len(known) or bool(known.std() <= FLAT * np.abs(known).max())
    if not flat and whole.sum() >= 2 * REPLICATES:
        found = _jackknifed(f[whole], np.arange(len(f))[whole] % REPLICATES)
    if found and not whole.all():
        for fill in (known.min(), known.mean(), known.max()):
            there = _jackknifed(np.where(np.isnan(f), fill, f), np.arange(len(f)) % REPLICATES)
            found = [_around(a, b) for a, b in zip(found, there, strict=True)]
    notes = _notes(flat, int(whole.sum()), len(f), len(known), f.size)
    d, pairs = len(told[2]), list(combinations(told[2], 2))
    mean, deviation, *each = found or [NOTHING] * (2 + 2 * d + len(pairs))  # in the order of ``_numbers``
    second = dict(zip(pairs, each[2 * d :], strict=True))
    return Indices(*told, tuple(each[:d]), tuple(each[d : 2 * d]), second, mean, deviation, len(f), f.size, missing, tuple(notes))


def _notes(flat: bool, whole: int, points: int, known: int, cases: int) -> list[str]:
    """Notes about a result. whole: number of complete points among ``points``; known: number of cases with a value among
    ``cases``."""
    if flat:
        return ["the result does not vary" if known else "no case has a value"]
    notes = [] if whole >= 2 * REPLICATES else [f"only {whole} points have values in all their cases: no index can be estimated"]
    if whole < points:
        notes.append(
            f"{cases - known} of {cases} cases have no value, in {points - whole} of {points} points. The estimates use the other "
            "points. The intervals include the estimates with the least, mean and largest value in place of missing values. Values "
            "outside this range may give other estimates"
        )
    return notes


def _around(a: Estimate, b: Estimate) -> Estimate:
    """The estimate a, with the smallest interval that contains the intervals of a and b."""
    if a.low is None or b.low is None or a.high is None or b.high is None:
        return a
    return Estimate(a.value, min(a.low, b.low), max(a.high, b.high))


def _jackknifed(f: np.ndarray, group: np.ndarray) -> list[Estimate]:
    """The estimates of ``_numbers`` with jackknife intervals. group: replicate of each point."""
    student = brought("scipy.special", "analysis", "an interval").stdtrit
    present = np.unique(group)
    r = len(present)
    whole = _numbers(f)
    pseudo = np.array([r * whole - (r - 1) * _numbers(f[group != g]) for g in present])
    middle, half = pseudo.mean(axis=0), student(r - 1, 0.5 + 0.5 * CONFIDENCE) * pseudo.std(axis=0, ddof=1) / np.sqrt(r)
    return [Estimate(float(m), float(m - h), float(m + h)) for m, h in zip(middle, half, strict=True)]


def _numbers(f: np.ndarray) -> np.ndarray:
    """Mean, standard deviation, first, total and second indices of f (one row per point, one column per case of the point)."""
    d = f.shape[1] // 2 - 1
    mean = 0.5 * (f[:, 0].mean() + f[:, -1].mean())
    g = f - mean  # subtracting the mean reduces rounding errors and the variance of the estimates
    a, b, ai, bi = g[:, 0], g[:, -1], g[:, 1 : d + 1].T, g[:, d + 1 : -1].T
    deviation, variance = np.sqrt(0.5 * ((a * a).mean() + (b * b).mean())), 0.5 * ((a - b) ** 2).mean()
    first = 0.5 * ((b * (ai - a)).mean(axis=1) + (a * (bi - b)).mean(axis=1)) / variance
    total = 0.25 * (((a - ai) ** 2).mean(axis=1) + ((b - bi) ** 2).mean(axis=1)) / variance
    cross = (a * b).mean()
    pairs = [
        (0.5 * ((bi[i] * ai[j]).mean() + (ai[i] * bi[j]).mean()) - cross) / variance - first[i] - first[j]
        for i, j in combinations(range(d), 2)
    ]
    return np.concatenate([[mean, deviation], first, total, pairs])
