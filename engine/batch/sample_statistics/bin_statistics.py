"""Statistics of cases in bins over one or two numbers: counts, outcomes, and the least, mean and largest value of a third number.

The module reads tables one by one and does not store them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from math import inf
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass

MOST_BINS = 200
"""Largest number of bins along an axis."""
Picked = dict[str, np.ndarray]
"""Columns by name; NaN where a number is missing."""


@dataclass(frozen=True)
class Axis:
    """An axis of bins.

    Attributes:
        name: column of the axis.
        edges: n + 1 edges; bin i contains edges[i] <= x < edges[i + 1], and the last bin also contains its upper edge.
        values: the distinct numbers on the axis (n), one number in each bin; None if there are too many.
    """

    name: str
    edges: np.ndarray
    values: np.ndarray | None

    def place(self, x: np.ndarray) -> np.ndarray:
        """The bin of each number (n); −1 for NaN and infinite numbers."""
        known = np.isfinite(x)
        at = np.searchsorted(self.edges, np.where(known, x, self.edges[0]), side="right") - 1
        return np.where(known, np.clip(at, 0, len(self.edges) - 2), -1)


@dataclass
class Span:
    """The range of a column, and the distinct numbers of the column while there are at most MOST_BINS."""

    name: str
    low: float = inf
    high: float = -inf
    values: np.ndarray | None = field(default_factory=lambda: np.zeros(0))

    def see(self, x: np.ndarray) -> None:
        """Include n further numbers."""
        x = x[np.isfinite(x)]
        if len(x):
            self.low, self.high = min(self.low, float(x.min())), max(self.high, float(x.max()))
        if self.values is not None:
            self.values = np.union1d(self.values, x)
            if len(self.values) > MOST_BINS:
                self.values = None

    def axis(self, bins: int) -> Axis:
        """An axis with one bin for each distinct number, if there are at most ``bins`` numbers. Otherwise an axis with ``bins``
        equal bins."""
        v = self.values
        if v is not None and 0 < len(v) <= bins:
            half = np.diff(v) / 2 if len(v) > 1 else np.array([0.5 * abs(v[0]) or 0.5])
            edges = np.concatenate([[v[0] - half[0]], v[:-1] + half, [v[-1] + half[-1]]]) if len(v) > 1 else v[0] + half * [-1, 1]
            return Axis(self.name, edges, v)
        low, high = (self.low, self.high) if self.low <= self.high else (0.0, 1.0)
        if not low < high:
            low, high = low - (0.5 * abs(low) or 0.5), high + (0.5 * abs(high) or 0.5)
        return Axis(self.name, np.linspace(low, high, bins + 1), None)


class Bins:
    """Counts of cases by bin. of: name of the third number, "" for none. The cell of bins i and j has the index ``i * len(y) +
    j``."""

    def __init__(self, x: Axis, y: Axis | None, of: str):
        self.x, self.y, self.of = x, y, of
        self.size = (len(x.edges) - 1) * (len(y.edges) - 1 if y else 1)
        self.count = np.zeros(self.size, np.int64)
        self.first = np.full(self.size, np.iinfo(np.int64).max)
        self.outcomes: dict[str, np.ndarray] = {}
        self.known, self.sum = np.zeros(self.size, np.int64), np.zeros(self.size)
        self.least, self.most = np.full(self.size, inf), np.full(self.size, -inf)
        self.missing: dict[str, int] = {}

    def add(self, cases: Picked, outcome: np.ndarray) -> None:
        """Count cases (columns of n numbers, n outcomes). Cases that have no number on one of the axes are counted as missing."""
        at = self.x.place(cases[self.x.name])
        if self.y is not None:
            j = self.y.place(cases[self.y.name])
            at = np.where((at >= 0) & (j >= 0), at * (len(self.y.edges) - 1) + j, -1)
        there = at >= 0
        for name in np.unique(outcome):
            some = outcome == name
            counts = np.bincount(at[some & there], minlength=self.size)
            if counts.any():
                self.outcomes[str(name)] = self.outcomes.get(str(name), 0) + counts
            if lost := int((some & ~there).sum()):
                self.missing[str(name)] = self.missing.get(str(name), 0) + lost
        self.count += np.bincount(at[there], minlength=self.size)
        np.minimum.at(self.first, at[there], cases["case"][there].astype(np.int64))
        if self.of:
            v = cases[self.of]
            there &= np.isfinite(v)
            self.known += np.bincount(at[there], minlength=self.size)
            self.sum += np.bincount(at[there], v[there], minlength=self.size)
            np.minimum.at(self.least, at[there], v[there])
            np.maximum.at(self.most, at[there], v[there])

    def cells(self) -> dict[str, Any]:
        """The bins with cases as parallel lists: bins, cases, first cases, outcomes, values."""
        at = np.flatnonzero(self.count)
        wide = len(self.y.edges) - 1 if self.y else 1
        out: dict[str, Any] = {"x": (at // wide).tolist(), "y": (at % wide).tolist() if self.y else None}
        out |= {"cases": self.count[at].tolist(), "first": self.first[at].tolist()}
        out |= {"outcomes": {name: n[at].tolist() for name, n in sorted(self.outcomes.items())}}
        if not self.of:
            return out | {"known": None, "least": None, "mean": None, "most": None}
        has = self.known[at] > 0
        mean = self.sum[at] / np.maximum(1, self.known[at])
        numbers = {"least": self.least[at], "mean": mean, "most": self.most[at]}
        out["known"] = self.known[at].tolist()
        return out | {n: [float(v) if h else None for v, h in zip(x, has, strict=True)] for n, x in numbers.items()}


@dataclass(frozen=True)
class Within:
    """A condition on cases. Either the number in a column lies from low to high, or the text in a column is one of some words."""

    name: str
    low: float = -inf
    high: float = inf
    words: tuple[str, ...] | None = None

    def holds(self, x: np.ndarray) -> np.ndarray:
        """Whether each of n values meets the condition. NaN never meets a condition."""
        if self.words is not None:
            return np.isin(x, self.words)
        return (x >= self.low) & (x <= self.high)


def picked(table: Any, names: Iterable[str], within: Iterable[Within]) -> tuple[Picked, np.ndarray, int]:
    """(columns by name, outcomes, number of excluded cases). Columns and outcomes contain only the cases that meet all
    conditions."""
    columns = {n: _column(table[n]) for n in dict.fromkeys([*names, "case", "outcome", *(w.name for w in within)])}
    keep = np.ones(len(table), bool)
    for w in within:
        keep &= w.holds(columns[w.name])
    outcome = columns.pop("outcome")
    return {n: x[keep] for n, x in columns.items()}, outcome[keep], int(len(table) - keep.sum())


def _column(column: Any) -> np.ndarray:
    """A column as numbers (NaN for null) or words."""
    x: np.ndarray = column.to_numpy(zero_copy_only=False)
    return x.astype(str) if x.dtype == object else x.astype(float)


def binned(tables: Iterable[Picked], x: str, y: str, bins: tuple[int, int]) -> tuple[Axis, Axis | None]:
    """The axes for the columns x and y ("": no axis) of tables from ``picked``."""
    spans = [Span(n) for n in (x, y) if n]
    for table in tables:
        for s in spans:
            s.see(table[s.name])
    axes = [s.axis(n) for s, n in zip(spans, bins, strict=False)]
    return axes[0], axes[1] if y else None
