"""Curves of nonlinear springs and dampers, by SciPy: monotone cubic pieces. Beyond their ends, the curves continue straight."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator


@lru_cache(maxsize=64)
def characteristic(at: tuple[float, ...], value: tuple[float, ...]) -> Characteristic:
    """The curve through points."""
    return Characteristic(at, value)


class Characteristic:
    """The curve through points, and its integral from the first point. The slope at each end is the slope of the end chord."""

    def __init__(self, at: Sequence[float], value: Sequence[float]):
        self.at, self.value = np.array(at, float), np.array(value, float)
        chords = np.diff(self.value) / np.diff(self.at)
        slopes = PchipInterpolator(self.at, self.value).derivative()(self.at) if len(chords) > 1 else chords.repeat(2)
        self.ends = float(chords[0]), float(chords[-1])
        slopes[0], slopes[-1] = self.ends
        self.inside = CubicHermiteSpline(self.at, self.value, slopes)
        self.integral = self.inside.antiderivative()

    def __call__(self, x):
        low, high = self._beyond(x)
        return self.inside(x - low - high) + self.ends[0] * low + self.ends[1] * high

    def area(self, x):
        """The integral from the first point to x."""
        low, high = self._beyond(x)
        more = sum(v * d + 0.5 * s * d * d for v, s, d in zip(self.value[[0, -1]], self.ends, (low, high), strict=True))
        return self.integral(x - low - high) + more

    def _beyond(self, x):
        """Distances of x below the first point and above the last point."""
        return np.minimum(x - self.at[0], 0.0), np.maximum(x - self.at[-1], 0.0)


def nonlinear(group, x, rate):
    """(force, dissipated power, which is ≤ 0, stored energy) of nonlinear springs and dampers at coordinates x and rates. The force
    acts against x. ``group``: their keys in a scene."""
    if group is None:
        return 0.0, 0.0, 0.0
    lost = stored = elastic = 0.0
    if group.spring_curve is not None:
        curve = characteristic(group.spring_curve.at, group.spring_curve.effort)
        elastic, stored = curve(x), curve.area(x)
    if group.quadratic_damping is not None:
        lost += group.quadratic_damping * abs(rate) * rate
    if group.damping_curve is not None:
        given = group.damping_curve
        curve = characteristic(given.speed, given.effort)
        sign = np.where((given.speed[0] == 0.0) & (np.asarray(rate) < 0.0), -1.0, 1.0)
        lost += sign * curve(sign * rate)
    return elastic + lost, -lost * rate, stored
