"""A sliding band around a drum, in flat pieces. At each corner, the two tensions, the normal force along the bisector and friction
are in balance. With n corners, the difference from a round drum is proportional to 1/n²."""

from __future__ import annotations

import math

import numpy as np


def _polygon(k: float, wrap: float, corners: int) -> tuple[float, np.ndarray]:
    """(tension at the end, force on the drum) for the tension 1 at the start, where the band runs along −e2. k: friction on the
    band per normal force, against the band's direction. Angles run around the drum from e1."""
    half, tension, force = 0.5 * wrap / corners, 1.0, np.zeros(2)
    for n in range(corners):
        at = (2 * n + 1) * half
        # along the corner's tangent: T' cos = T cos + k N; along its normal: (T' + T) sin = N
        more = tension * (math.cos(half) + k * math.sin(half)) / (math.cos(half) - k * math.sin(half))
        normal = (more + tension) * math.sin(half)
        force += -normal * np.array([math.cos(at), math.sin(at)]) + k * normal * np.array([-math.sin(at), math.cos(at)])
        tension = more
    return tension, force


def band(k: float, wrap: float, corners: int = 400) -> tuple[float, np.ndarray]:
    """The tension at the end and the force on a round drum, extrapolated from three numbers of corners."""
    (t1, f1), (t2, f2), (t3, f3) = (_polygon(k, wrap, corners * n) for n in (1, 2, 4))

    def limit(a, b, c):
        once = (4 * b - a) / 3, (4 * c - b) / 3
        return (16 * once[1] - once[0]) / 15

    return float(limit(t1, t2, t3)), limit(f1, f2, f3)
