"""Signals that the runtime reads from memory: tables as piecewise curves, and external inputs. Each is one record of numbers.

Tables (t_i, v_i) become linear, a cubic spline with continuous second derivative (kept as values and second derivatives at the
knots), or a cubic that goes up and down only where the values do (values and slopes; its second derivative jumps at the knots).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from engine.abi import TableKind
from engine.abi.runs import INPUT, KNOTS
from engine.scene import model as sm

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
    from scipy.linalg import solve_banded

    n, h = len(t), np.diff(t)
    if n < 3 and ends is None:
        return np.zeros(n)
    slope = np.diff(v) / h
    bands, right = np.zeros((3, n)), np.zeros(n)
    bands[1, 0] = bands[1, -1] = 1.0
    bands[0, 2:], bands[1, 1:-1], bands[2, :-2] = h[1:] / 6, (h[:-1] + h[1:]) / 3, h[:-1] / 6
    right[1:-1] = np.diff(slope)
    if ends is not None:
        bands[1, 0], bands[0, 1], right[0] = h[0] / 3, h[0] / 6, slope[0] - ends[0]
        bands[1, -1], bands[2, -2], right[-1] = h[-1] / 3, h[-1] / 6, ends[1] - slope[-1]
    return solve_banded((1, 1), bands, right)


def monotone_slopes(t: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Slopes at the knots (n) of Fritsch and Carlson's piecewise cubic (PCHIP): zero where the values turn or stay."""
    from scipy.interpolate import PchipInterpolator

    return PchipInterpolator(t, v).derivative()(t)
