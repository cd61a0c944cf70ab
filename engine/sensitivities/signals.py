"""External values at a time: the part of the runtime's input vector that depends on it (time and tables)."""

from __future__ import annotations

import numpy as np

from engine.simulation.block import spline_moments
from engine.system.numbers import Numbers


class Signals:
    """Tables of a run: piecewise linear or natural cubic splines, straight on beyond their ends."""

    def __init__(self, numbers: Numbers, inputs: int):
        self.first = 2 + inputs
        self.tables = [(kind == "spline", t, v, spline_moments(t, v) if kind == "spline" else np.zeros(len(t)))
                       for kind, t, v in numbers.tables]

    def fill(self, x: np.ndarray, t: float) -> None:
        """Write t and every table's value and three derivatives into x; the interval is chosen by x[1]."""
        x[0] = t
        for k, table in enumerate(self.tables):
            at = self.first + 4 * k
            x[at : at + 4] = _table(*table, t, x[1])


def _table(spline: bool, tt: np.ndarray, v: np.ndarray, m: np.ndarray, t: float, ts: float) -> tuple[float, float, float, float]:
    if ts <= tt[0] or ts >= tt[-1]:
        e, a = (0, 0) if ts <= tt[0] else (len(tt) - 1, len(tt) - 2)
        h = tt[a + 1] - tt[a]
        slope = (v[a + 1] - v[a]) / h
        if not spline:
            return float(v[e]), 0.0, 0.0, 0.0
        slope += -h / 6 * (2 * m[a] + m[a + 1]) if e == 0 else h / 6 * (m[a] + 2 * m[a + 1])
        return float(v[e] + slope * (t - tt[e])), float(slope), 0.0, 0.0
    i = int(np.searchsorted(tt, ts, side="right")) - 1
    h = tt[i + 1] - tt[i]
    a, b = (tt[i + 1] - t) / h, (t - tt[i]) / h
    value, slope = a * v[i] + b * v[i + 1], (v[i + 1] - v[i]) / h
    if not spline:
        return float(value), float(slope), 0.0, 0.0
    value += ((a**3 - a) * m[i] + (b**3 - b) * m[i + 1]) * h * h / 6
    slope += h / 6 * ((3 * b * b - 1) * m[i + 1] - (3 * a * a - 1) * m[i])
    return float(value), float(slope), float(a * m[i] + b * m[i + 1]), float((m[i + 1] - m[i]) / h)
