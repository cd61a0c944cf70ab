"""Sobol indices of a crossed sample (``sampling="saltelli"``), each with an interval.

With f over samples A and B, A_i being A with number i from B, B_i the reverse (Saltelli et al. 2010; both halves are used):
first S_i = ½ ⟨f_B (f_Ai − f_A) + f_A (f_Bi − f_B)⟩ / V, total T_i = ¼ ⟨(f_A − f_Ai)² + (f_B − f_Bi)²⟩ / V (Jansen 1999), together
S_ij = ⟨½ (f_Bi f_Aj + f_Ai f_Bj) − f_A f_B⟩ / V − S_i − S_j, and V = ½ ⟨(f_A − f_B)²⟩: so a number that does all has 1, one that
does nothing has 0, whatever the points.

Intervals: the points are in REPLICATES scrambles that do not depend on each other; each is left out in turn (the jackknife), and
what the results without it differ by gives an interval by Student's t. So they hold for points that are spread evenly, too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.basics.extras import brought
from engine.basics.problems import Problem, SceneError
from engine.batch.evenly import REPLICATES

if TYPE_CHECKING:
    import pyarrow

CONFIDENCE = 0.95
FAILED = "failed"
"""What is given of besides the reductions where some cases fail: 1 for a case that did not end as ``done``, else 0."""
FLAT = 1e-12
"""A standard deviation below this part of the largest value is rounding: the result does not vary."""


@dataclass(frozen=True)
class Estimate:
    """A number with the interval that holds the true one with 95 % confidence; all None where nothing can be said."""

    value: float | None
    low: float | None
    high: float | None


NOTHING = Estimate(None, None, None)


@dataclass(frozen=True)
class Indices:
    """How far each varied number decides over a result. of, unit: the result; paths: the numbers; first, total (by path): the part
    of the variance that goes when the number is known, that stays when all others are; second: {(path, path): what two do together
    beyond what each does}; mean, deviation: of the result, over the sample; points, cases; missing: cases without a value, by why
    (their outcome, or ``no value``); notes: what is to be known besides."""

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
        """As plain data."""
        second = [{"paths": list(pair), **asdict(e)} for pair, e in self.second.items()]
        plain = {n: getattr(self, n) for n in ("of", "unit", "points", "cases", "missing")}
        of = {n: zip(self.paths, getattr(self, n), strict=True) for n in ("first", "total")}
        both = {n: [{"path": p, **asdict(e)} for p, e in pairs] for n, pairs in of.items()}
        spread = {n: asdict(getattr(self, n)) for n in ("mean", "deviation")}
        return plain | spread | both | {"second": second, "confidence": CONFIDENCE, "notes": list(self.notes)}


def indices(table: pyarrow.Table, paths: Sequence[str], names: Sequence[str], units: Mapping[str, str]) -> list[Indices]:
    """The indices of results (columns of the table of a crossed sample), and of failing where some cases fail. Rows are in order of
    cases; points that are not whole at the end (a run that was stopped) are left out. SceneError where there are too few."""
    each = 2 * len(paths) + 2
    cases = table["case"].to_numpy()
    n = int(np.argmin(cases == np.arange(len(cases)))) if len(cases) and (cases != np.arange(len(cases))).any() else len(cases)
    points = n // each
    enough(points)
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


def enough(points: int) -> None:
    """SceneError where too few points have been run."""
    if points < 2 * REPLICATES:
        what = f"{points} points of the crossed sample have been run; {2 * REPLICATES} are the least"
        raise SceneError([Problem("indices", what, "wait until more have been run, or give a larger count")])


def _missing(values: np.ndarray, outcome: np.ndarray) -> dict[str, int]:
    """Cases without a value, by why."""
    why = np.where(outcome == "done", "no value", outcome)[np.isnan(values)]
    return {str(w): int((why == w).sum()) for w in dict.fromkeys(why.tolist())}


def _indices(told: tuple[str, str, tuple[str, ...]], f: np.ndarray, missing: dict[str, int]) -> Indices:
    """The indices of one result (points × cases of a point); NaN where a case has none."""
    of, unit, paths = told
    d = len(paths)
    whole = ~np.isnan(f).any(axis=1)
    known = f[~np.isnan(f)]
    found = [NOTHING] * (2 + 2 * d + d * (d - 1) // 2)
    flat = not len(known) or bool(known.std() <= FLAT * np.abs(known).max())
    if not flat and whole.sum() >= 2 * REPLICATES:
        found = _jackknifed(f[whole], np.arange(len(f))[whole] % REPLICATES)
    if not whole.all() and not flat:
        for fill in (known.min(), known.mean(), known.max()):
            there = _jackknifed(np.where(np.isnan(f), fill, f), np.arange(len(f)) % REPLICATES)
            found = [around(a, b) for a, b in zip(found, there, strict=True)]
    notes = told_of(flat, int(whole.sum()), len(f), len(known), f.size)
    second = dict(zip(combinations(paths, 2), found[2 + 2 * d :], strict=True))
    first, total = tuple(found[2 : 2 + d]), tuple(found[2 + d : 2 + 2 * d])
    return Indices(of, unit, paths, first, total, second, found[0], found[1], len(f), f.size, missing, tuple(notes))


def told_of(flat: bool, whole: int, points: int, known: int, cases: int) -> list[str]:
    """What is to be known besides: of a result that has values in so many of its cases, in all of them in so many points."""
    if flat:
        return ["it does not vary" if known else "no case has a value"]
    notes = [] if whole >= 2 * REPLICATES else [f"only {whole} points have values in all their cases: nothing can be said"]
    if whole < points:
        notes.append(
            f"{cases - known} of {cases} cases have no value, which touches {points - whole} of {points} points: the numbers are "
            "of the others, the intervals hold also what comes out with the least, the mean and the largest value seen in place of "
            "the missing ones (with values that follow the numbers in another way it may be something else still)"
        )
    return notes


def around(a: Estimate, b: Estimate) -> Estimate:
    """The first, with an interval that holds both."""
    if a.low is None or b.low is None or a.high is None or b.high is None:
        return a
    return Estimate(a.value, min(a.low, b.low), max(a.high, b.high))


def _jackknifed(f: np.ndarray, group: np.ndarray) -> list[Estimate]:
    """Every number of ``_numbers`` with an interval, from leaving out each group in turn."""
    return jackknifed(lambda kept: _numbers(f[kept]), group)


def jackknifed(numbers: Callable[[np.ndarray], np.ndarray], group: np.ndarray) -> list[Estimate]:
    """Numbers of a sample with intervals, from leaving out each group in turn. numbers: of the rows marked; group: of each row."""
    student = brought("scipy.special", "analysis", "an interval").stdtrit
    present = np.unique(group)
    r = len(present)
    whole = numbers(np.ones(len(group), bool))
    pseudo = np.array([r * whole - (r - 1) * numbers(group != g) for g in present])
    middle, half = pseudo.mean(axis=0), student(r - 1, 0.5 + 0.5 * CONFIDENCE) * pseudo.std(axis=0, ddof=1) / np.sqrt(r)
    return [Estimate(float(m), float(m - h), float(m + h)) for m, h in zip(middle, half, strict=True)]


def _numbers(f: np.ndarray) -> np.ndarray:
    """Mean, standard deviation, first and total indices, and those of pairs, of points × cases of a point."""
    d = f.shape[1] // 2 - 1
    mean = 0.5 * (f[:, 0].mean() + f[:, -1].mean())
    g = f - mean  # no estimate depends on this but for rounding, and for how well it is known
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
