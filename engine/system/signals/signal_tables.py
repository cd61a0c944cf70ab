"""Signals that the runtime reads from memory: tables as piecewise curves, and external inputs. Each table and each input is a
record of numbers.

A table (t_i, v_i) becomes one of three kinds of curves.
LINEAR: straight lines between the knots.
SPLINE: a cubic spline with continuous second derivative, stored as values and second derivatives at the knots.
HERMITE: a piecewise cubic that is monotone wherever the values are, stored as values and slopes at the knots.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.abi import TableKind
from trunnion.runtime.abi.run_records import INPUT, KNOTS
from trunnion.scene.data_classes import scene as sm

DRIVE, LOAD = "natural", "linear"
"""Default interpolation of drives and of loads. (For drives, linear interpolation would give no continuous acceleration, and a
clamped spline would give a rate of zero at both ends.)"""


@dataclass(frozen=True, eq=False)
class SignalCurve:
    """A table as a piecewise curve.

    held    whether the curve is constant beyond its ends; otherwise it continues linearly.
    time    knots (n), s.
    value   values at the knots (n).
    shape   second derivatives for SPLINE, slopes for HERMITE, zeros for LINEAR (n)."""

    kind: TableKind
    held: bool
    time: np.ndarray
    value: np.ndarray
    shape: np.ndarray

    def record(self) -> np.ndarray:
        """The record that the runtime reads: ``tr_knots``, then time, value and shape."""
        head = KNOTS.doubles(kind=self.kind, held=self.held, n=len(self.time))
        return np.concatenate([head, self.time, self.value, self.shape])

    def alike(self, other: SignalCurve | ExternalInput) -> bool:
        """Whether two cases of a batch may share a table: their records are equal."""
        return isinstance(other, SignalCurve) and np.array_equal(self.record(), other.record())


@dataclass(frozen=True)
class ExternalInput:
    """An external input.

    tracked     whether a motion follows the input.
    start       value until the user sets the input.
    bandwidth   bandwidth of the filter by which a motion follows the input, rad/s.
    begin       time from which the input counts, s."""

    tracked: bool
    start: float
    bandwidth: float
    begin: float = -np.inf

    def record(self) -> np.ndarray:
        """The record that the runtime reads: ``tr_input``, with the start value from t = 0 on."""
        now = {"t0": 0.0, "u": (self.start, 0.0, 0.0), "gap": 0.0, "gap_rate": 0.0}
        late = {"start": self.start, "begin": self.begin}
        return np.array(INPUT.doubles(kind=TableKind.INPUT, followed=self.tracked, **now, bandwidth=self.bandwidth, **late), float)

    def alike(self, other: SignalCurve | ExternalInput) -> bool:
        """Whether two cases of a batch may share an input. The start values may differ, because each case stores its own start
        value."""
        return isinstance(other, ExternalInput) and (self.tracked, self.bandwidth, self.begin) == (
            other.tracked, other.bandwidth, other.begin)


def table_block(tables: Sequence[SignalCurve | ExternalInput]) -> np.ndarray:
    """All tables in the layout that the runtime reads: the offset of each record, then the records."""
    records = [t.record() for t in tables]
    offsets = len(records) + np.cumsum([0, *map(len, records)])[:-1]
    return np.concatenate([offsets, *records]).astype(float)


@lru_cache(maxsize=64)
def curve(table: sm.Table, drives: bool) -> SignalCurve:
    """The curve of a table. Beyond the ends, the curve of a drive continues linearly, and the curve of a load is constant."""
    t, v = np.array(table.time, float), np.array(table.value, float)
    way = table.interpolation or (DRIVE if drives else LOAD)
    if way == "linear":
        return SignalCurve(TableKind.LINEAR, not drives, t, v, np.zeros(len(t)))
    if way == "monotone":
        return SignalCurve(TableKind.HERMITE, not drives, t, v, monotone_slopes(t, v))
    ends = tuple(map(float, table.end_rates or (0.0, 0.0))) if way == "clamped" else None
    return SignalCurve(TableKind.SPLINE, not drives, t, v, spline_moments(t, v, ends))


def spline_moments(t: np.ndarray, v: np.ndarray, ends: tuple[float, ...] | None = None) -> np.ndarray:
    """Second derivatives (n) at the knots of the cubic spline through (t, v). ends: slopes at both ends; None: natural spline, with
    zero second derivatives at the ends. Time and memory are proportional to n."""
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
    """Solution (n) of a tridiagonal system (diagonals of n − 1, n, n − 1) by elimination without pivoting. Valid for diagonally
    dominant matrices, such as the matrices of splines."""
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

    The slope is zero at extrema and plateaus. Elsewhere it is a weighted harmonic mean of the slopes on both sides (Fritsch and
    Butland). The slope at each end is that of a parabola, limited to keep the curve monotone."""
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
    """Slope at an end. h, slope: length and slope of the end piece; beside, next_: length and slope of the adjacent piece."""
    found = ((2 * h + beside) * slope - h * next_) / (h + beside)
    if np.sign(found) != np.sign(slope):
        return 0.0
    if np.sign(slope) != np.sign(next_) and abs(found) > 3 * abs(slope):
        return 3 * slope
    return found
