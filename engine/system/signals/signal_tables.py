"""Signals that the runtime reads from memory: tables as piecewise curves, and external inputs. Each is one record of numbers.

A table (t_i, v_i) becomes one of three curves. LINEAR: straight lines. SPLINE: a cubic spline with continuous second derivative,
stored as values and second derivatives at the knots. HERMITE: a cubic that is monotone where the values are, stored as values and
slopes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from trunnion.runtime.abi import TableKind
from trunnion.runtime.abi.run_records import INPUT, KNOTS
from trunnion.scene.data_classes import scene as sm

DRIVE, LOAD = "natural", "linear"
"""How drives and loads interpolate when a table does not say. A drive needs a continuous acceleration, and zero rates at its ends
would falsify data that move there."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A table as a piecewise curve. held: whether the end values stay beyond the ends (else the curve goes straight on there);
    time (n), s; value (n); shape (n): second derivatives for SPLINE, slopes for HERMITE, zeros for LINEAR."""

    kind: TableKind
    held: bool
    time: np.ndarray
    value: np.ndarray
    shape: np.ndarray

    def record(self) -> np.ndarray:
        """The numbers the runtime reads: ``tr_knots``, then time, value and shape."""
        head = KNOTS.doubles(kind=self.kind, held=self.held, n=len(self.time))
        return np.concatenate([head, self.time, self.value, self.shape])

    def alike(self, other: Curve | Outside) -> bool:
        """Whether two cases of a batch may share this table: they may when it is the same."""
        return isinstance(other, Curve) and np.array_equal(self.record(), other.record())


@dataclass(frozen=True)
class Outside:
    """An external input. tracked: whether a motion follows it; start: its value until someone sets it; bandwidth, rad/s: how
    fast a motion follows it."""

    tracked: bool
    start: float
    bandwidth: float

    def record(self) -> np.ndarray:
        """The numbers the runtime reads: ``tr_input``, at its start value from t = 0 on."""
        now = {"t0": 0.0, "u": (self.start, 0.0, 0.0), "gap": 0.0, "gap_rate": 0.0}
        return np.array(INPUT.doubles(kind=TableKind.INPUT, followed=self.tracked, **now, bandwidth=self.bandwidth), float)

    def alike(self, other: Curve | Outside) -> bool:
        """Whether two cases of a batch may share this table: start values may differ, since each case has its own."""
        return isinstance(other, Outside) and (self.tracked, self.bandwidth) == (other.tracked, other.bandwidth)


def table_block(tables: Sequence[Curve | Outside]) -> np.ndarray:
    """All tables as the runtime reads them: the offset of each record, then the records."""
    records = [t.record() for t in tables]
    offsets = len(records) + np.cumsum([0, *map(len, records)])[:-1]
    return np.concatenate([offsets, *records]).astype(float)


@lru_cache(maxsize=64)
def curve(table: sm.Table, drives: bool) -> Curve:
    """The curve of a drive's table (straight on beyond its ends) or a load's (held there)."""
    t, v = np.array(table.time, float), np.array(table.value, float)
    way = table.interpolation or (DRIVE if drives else LOAD)
    if way == "linear":
        return Curve(TableKind.LINEAR, not drives, t, v, np.zeros(len(t)))
    if way == "monotone":
        return Curve(TableKind.HERMITE, not drives, t, v, monotone_slopes(t, v))
    ends = tuple(map(float, table.end_rates or (0.0, 0.0))) if way == "clamped" else None
    return Curve(TableKind.SPLINE, not drives, t, v, spline_moments(t, v, ends))


def spline_moments(t: np.ndarray, v: np.ndarray, ends: tuple[float, ...] | None = None) -> np.ndarray:
    """Second derivatives at the knots (n) of the cubic spline through (t, v) whose slopes at the ends are ``ends``; without them
    its second derivatives there are zero (natural). A tridiagonal system: time and memory grow with n."""
    n, h = len(t), np.diff(t)
    if n < 3 and ends is None:
        return np.zeros(n)
    slope = np.diff(v) / h
    above, diagonal, below, right = np.zeros(n - 1), np.ones(n), np.zeros(n - 1), np.zeros(n)
    above[1:], diagonal[1:-1], below[:-1] = h[1:] / 6, (h[:-1] + h[1:]) / 3, h[:-1] / 6
    right[1:-1] = np.diff(slope)
    if ends is not None:
        diagonal[0], above[0], right[0] = h[0] / 3, h[0] / 6, slope[0] - ends[0]
        diagonal[-1], below[-1], right[-1] = h[-1] / 3, h[-1] / 6, ends[1] - slope[-1]
    return tridiagonal(below, diagonal, above, right)


def tridiagonal(below: np.ndarray, diagonal: np.ndarray, above: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution (n) of a system with three diagonals (n − 1, n, n − 1) by elimination without pivoting. Valid for diagonally
    dominant matrices, such as those of splines."""
    low, d, up, x = (a.tolist() for a in (below, diagonal, above, right))
    for i in range(1, len(d)):
        factor = low[i - 1] / d[i - 1]
        d[i] -= factor * up[i - 1]
        x[i] -= factor * x[i - 1]
    x[-1] /= d[-1]
    for i in reversed(range(len(d) - 1)):
        x[i] = (x[i] - up[i] * x[i + 1]) / d[i]
    return np.array(x)


def monotone_slopes(t: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Slopes at the knots (n) of the monotone piecewise cubic of Fritsch and Carlson (PCHIP).

    Zero at extremes and plateaus, else a harmonic mean of the slopes on both sides (Fritsch and Butland). At the ends, the slope
    of a parabola, limited to stay monotone.
    """
    h = np.diff(t)
    slope = np.diff(v) / h
    if len(t) == 2:
        return np.full(2, slope[0])
    one, two = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    before, after = slope[:-1], slope[1:]
    goes_on = np.sign(before) * np.sign(after) > 0
    inside = np.zeros(len(t) - 2)
    inside[goes_on] = (one + two)[goes_on] / (one[goes_on] / before[goes_on] + two[goes_on] / after[goes_on])
    return np.array([_end_slope(h[0], h[1], slope[0], slope[1]), *inside, _end_slope(h[-1], h[-2], slope[-1], slope[-2])])


def _end_slope(h: float, beside: float, slope: float, next_: float) -> float:
    """Slope at an end, from the lengths and slopes of the piece there and of the one beside it."""
    found = ((2 * h + beside) * slope - h * next_) / (h + beside)
    if np.sign(found) != np.sign(slope):
        return 0.0
    if np.sign(slope) != np.sign(next_) and abs(found) > 3 * abs(slope):
        return 3 * slope
    return found
