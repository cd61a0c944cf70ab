"""Spline through the values of a cam's profile, as cubic pieces (theory, "Cams")."""

from __future__ import annotations

import math

import numpy as np

from trunnion.scene.data_classes.joint_couplings import Profile as Given
from trunnion.system.signals.signal_tables import spline_moments, tridiagonal
from trunnion.system.structure.coupling_joint_data import Profile
from trunnion.system.structure.parameter_table import Leaf

TURN = 2 * math.pi
AROUND = 1e-9
"""Tolerance of a closed profile, for round-off of values computed from parameters: deviation of the angles' span from 2π, rad, and
relative deviation of the last radius from the first."""


def closed(given: Given) -> bool:
    """Whether a profile spans a full turn and its last radius equals its first."""
    around = abs(given.angle[-1] - given.angle[0] - TURN) < AROUND
    return around and abs(given.radius[-1] - given.radius[0]) < AROUND * given.radius[0]


def profile(given: Given, roller: Leaf, internal: bool = False) -> Profile:
    """The cubic spline through a checked profile. The spline is periodic if the profile is closed. Otherwise, the spline has no
    curvature at its ends and continues linearly beyond them. internal: whether the follower is inside the cam."""
    angle, radius = np.array(given.angle, float), np.array(given.radius, float)
    if closed(given):
        angle[-1], radius[-1] = angle[0] + TURN, radius[0]
    middle = 0.5 * (angle[0] + angle[-1])
    pieces, moments = spline_pieces(angle, radius, closed(given))
    starts = angle[:-1] - middle
    if not closed(given):  # add a linear piece beyond each end
        end = pieces[-1, 1] + (angle[-1] - angle[-2]) * (0.5 * moments[-2] + 0.5 * moments[-1])
        before = [radius[0], pieces[0, 1], 0.0, 0.0]
        pieces = np.vstack([before, pieces, [radius[-1], end, 0.0, 0.0]])
        starts = np.array([starts[0], *starts, angle[-1] - middle])
    half, side = 0.5 * float(angle[-1] - angle[0]), -1.0 if internal else 1.0
    kept = tuple(map(float, starts)), tuple(map(tuple, pieces.tolist()))
    return Profile((math.cos(middle), math.sin(middle)), half, side, roller, *kept)


def spline_pieces(x: np.ndarray, y: np.ndarray, around: bool) -> tuple[np.ndarray, np.ndarray]:
    """The cubic spline through n points: the coefficients of its pieces (n − 1 × 4), and its second derivatives at the points. The
    spline is periodic (``around``), or has no curvature at its ends."""
    moments = periodic_moments(x, y) if around else spline_moments(x, y)
    h, bend = np.diff(x), np.diff(moments)
    slope = np.diff(y) / h - h * (2 * moments[:-1] + moments[1:]) / 6
    return np.column_stack([y[:-1], slope, 0.5 * moments[:-1], bend / (6 * h)]), moments


def periodic_moments(angle: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Second derivatives of the periodic cubic spline at the n knots. The last value repeats the first. Time and memory are
    proportional to n.

    The matrix is tridiagonal except for its two corners c: A = T + c w wᵀ, w = (1, 0, …, 0, 1). So x = y − z c (wᵀy)/(1 + c wᵀz)
    with T y = b and T z = w (Sherman and Morrison).
    """
    h, slope = np.diff(angle), np.diff(radius) / np.diff(angle)
    right, before = slope - np.roll(slope, 1), np.roll(h, 1)
    diagonal, corner, ends = (before + h) / 3, before[0] / 6, np.zeros(len(h))
    ends[0] += 1.0
    ends[-1] += 1.0
    diagonal[0] -= corner
    diagonal[-1] -= corner
    y, z = (tridiagonal(h[:-1] / 6, diagonal, h[:-1] / 6, b) for b in (right, ends))
    found = y - z * (corner * (ends @ y) / (1.0 + corner * (ends @ z)))
    return np.append(found, found[0])
