"""Smooth curves through given points as symbolic expressions. A curve is monotone wherever its points are monotone."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from trunnion.basics.lazy_casadi import SX, ca

KNOTS = 12
"""Largest number of points of a curve. Curves with fewer points repeat the last point, so that all curves have the same
expression."""


def filled(points: Sequence, count: int = KNOTS) -> list:
    """The points, with the last point repeated until there are ``count``."""
    return [*points, *[points[-1]] * (count - len(points))]


def monotone(x: SX, at: Sequence[SX], value: Sequence[SX], flat: bool = True) -> SX:
    """The curve of cubic pieces through the points (at, value), with slopes by Fritsch and Butland. The curve is constant beyond
    its ends. The slope at the first point is 0 with ``flat``, otherwise the slope of the first chord. The last point may be
    repeated."""
    n = len(at)
    h = [at[i + 1] - at[i] for i in range(n - 1)]
    safe = [ca.if_else(x > 0, x, 1) for x in h]
    rise = [(value[i + 1] - value[i]) / s for i, s in enumerate(safe)]
    slope = [ca.SX(0) if flat else rise[0], *[_slope(h[i - 1 : i + 1], rise[i - 1 : i + 1]) for i in range(1, n - 1)], ca.SX(0)]
    out = ca.SX(value[0])
    for i in range(n - 1):
        u = ca.fmin(ca.fmax((x - at[i]) / safe[i], 0), 1)
        a, b = slope[i], slope[i + 1]
        out += h[i] * u * (a + u * (3 * rise[i] - 2 * a - b + u * (a + b - 2 * rise[i])))
    return out


def straight_beyond(x: SX, at: Sequence[SX], value: Sequence[SX]) -> tuple[SX, SX]:
    """(curve, integral of the curve from the first point to x). The curve has pieces as in ``monotone``. Beyond its ends, the curve
    is straight, with the slopes of its first and last chord. At a point of the curve, the derivatives of the piece at larger x
    apply."""
    n = len(at)
    h = [at[i + 1] - at[i] for i in range(n - 1)]
    safe = [ca.if_else(x > 0, x, 1) for x in h]
    rise = [(value[i + 1] - value[i]) / s for i, s in enumerate(safe)]
    for i in range(1, n - 1):  # a repeated last point has the slope of the last chord
        rise[i] = ca.if_else(h[i] > 0, rise[i], rise[i - 1])
    slope = [rise[0], *[_slope(safe[i - 1 : i + 1], rise[i - 1 : i + 1]) for i in range(1, n - 1)], rise[-1]]
    below, above = ca.if_else(x < at[0], x - at[0], 0), ca.if_else(x >= at[-1], x - at[-1], 0)
    out = value[0] + slope[0] * below + slope[-1] * above
    area = (value[0] + 0.5 * slope[0] * below) * below + (value[-1] + 0.5 * slope[-1] * above) * above
    for i in range(n - 1):
        u = ca.if_else(x >= at[i + 1], 1, ca.if_else(x >= at[i], (x - at[i]) / safe[i], 0))
        a, b, c = slope[i], 3 * rise[i] - 2 * slope[i] - slope[i + 1], slope[i] + slope[i + 1] - 2 * rise[i]
        out += h[i] * u * (a + u * (b + u * c))
        area += h[i] * u * (value[i] + h[i] * u * (a / 2 + u * (b / 3 + u * c / 4)))
    return out, area


def pieces_below(x: SX, at: Sequence[SX]) -> SX:
    """Number of pieces of a curve below x, with fractions. The number is 0 at the first point, and constant beyond the ends."""
    inside = (ca.if_else(b > a, (x - a) / ca.if_else(b > a, b - a, 1), 0) for a, b in pairwise(at))
    return sum((ca.fmin(ca.fmax(u, 0), 1) for u in inside), ca.SX(0))


def _slope(h: Sequence[SX], rise: Sequence[SX]) -> SX:
    """Slope at the point between two pieces: 0 at a local extremum, otherwise a weighted harmonic mean of the slopes of both
    chords."""
    one, two, product = 2 * h[1] + h[0], h[1] + 2 * h[0], rise[0] * rise[1]
    below = one * rise[1] + two * rise[0]
    return ca.if_else(product > 0, (one + two) * product / ca.if_else(product > 0, below, 1), 0)
