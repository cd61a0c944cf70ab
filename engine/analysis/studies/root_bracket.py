"""A place between two cases at which a result has its target value: Chandrupatla's method (1997), which combines inverse quadratic
interpolation with bisection."""

from __future__ import annotations

from collections.abc import Generator

NARROW = 4e-16
"""Width of the bracket, relative to the segment, at which a search ends by default."""
MOST_STEPS = 20
CONTINUOUS = 1e-6
"""Largest remaining residual of a continuous result, relative to the residuals at the ends of the segment."""


def bracketed_root(
    first: float, second: float, enough: float, narrow: float = NARROW, most: int = MOST_STEPS
) -> Generator[float, float, bool]:
    """Search for a root of a residual on a segment. first, second: residuals at its ends (0 and 1), of opposite signs. enough:
    residual that counts as 0. narrow, most: width of the bracket and number of steps at which the search ends. The generator yields
    places on the segment and receives their residuals. A failed case has the residual NaN and ends the search. The generator
    returns whether it has found a root. A jump across zero is not a root."""
    a, b, c = 1.0, 0.0, 0.0  # the root lies between a and b; c is the previous point
    fa, fb, fc = second, first, first
    share = 0.5
    for _ in range(most):
        x = a + share * (b - a)
        fx = yield x
        if fx != fx:
            return False
        if (fx > 0.0) == (fa > 0.0):
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, fx
        least = min(abs(fa), abs(fb))
        width = narrow / max(abs(b - a), narrow)
        if least <= enough or width > 0.5:
            return least <= max(enough, CONTINUOUS * (abs(first) + abs(second)))
        share = 0.5
        if fa not in (fb, fc) and fb != fc:
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
                share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        share = min(1.0 - width, max(width, share))
    return least <= CONTINUOUS * (abs(first) + abs(second))
