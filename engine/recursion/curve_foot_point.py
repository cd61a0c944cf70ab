"""The foot of a point on a curve (theory, "Points on curves"). The line from the foot to the point is normal to the curve."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.coupling_joint_data import ENDLESS, FOOT, Curve, gauss_points

ROUNDS, STEPS = 3, 3
"""ROUNDS: number of rounds of the search for a foot. A round makes STEPS Newton steps, then finds the piece that contains the
foot."""


def evaluate_curve(foot: Sequence[SX]) -> tuple[SX, SX, SX]:
    """Position on the curve, m, and its first and second derivative with respect to the parameter (2 each). foot: the values of
    ``coupling_joint_data.FOOT``."""
    x, both = foot[-1] - foot[0], (foot[2:6], foot[6:10])
    at = [a + x * (b + x * (c + x * d)) for a, b, c, d in both]
    way = [b + x * (2 * c + 3 * x * d) for _, b, c, d in both]
    return ca.vertcat(*at), ca.vertcat(*way), ca.vertcat(*(2 * c + 6 * x * d for _, _, c, d in both))


def refine_foot(foot: Sequence[SX], p: SX) -> SX:
    """Parameter of the foot of point p after one Newton step from ``foot``. If p is near or beyond the centre of curvature, the
    slope for Newton's step is too small; a Gauss–Newton step then replaces Newton's step."""
    at, way, bend = evaluate_curve(foot)
    gap, square = p - at, ca.dot(way, way)
    slope: SX = square - ca.dot(gap, bend)
    return foot[-1] + ca.dot(gap, way) / ca.if_else(slope > 0.1 * square, slope, square)


def arc_length(foot: Sequence[SX]) -> SX:
    """Arc length of the curve up to a foot, m."""
    half, out = 0.5 * (foot[-1] - foot[0]), foot[1]
    for x, weight in zip(*gauss_points(), strict=True):
        _, way, _ = evaluate_curve([*foot[:-1], foot[0] + half * (1 + x)])
        out += half * weight * ca.norm_2(way)
    return out


def find_foot(curve: Curve, p: SX) -> SX:
    """The foot nearest to point p, by Newton's method. Each piece gives a candidate: the projection of p on the piece's chord. The
    method starts at the candidate that is nearest to p."""
    best, nearest = [SX(0)] * FOOT, SX(0)
    for k, piece in enumerate(curve.pieces):
        numbers = [piece.start, piece.way, *piece.e2, *piece.e3]
        low, high = piece.start if k or curve.around else -ENDLESS, piece.end
        h = piece.end - piece.start if piece.end < ENDLESS else 0.0  # in an endless piece, the chord is the same for every h
        chord = ca.vertcat(*(_chord(of, h) for of in (piece.e2, piece.e3)))
        begin = ca.vertcat(piece.e2[0], piece.e3[0])
        u = ca.fmin(ca.fmax(piece.start + ca.dot(p - begin, chord) / ca.dot(chord, chord), low), high)
        off = p - evaluate_curve([*map(SX, numbers), u])[0]
        gap = ca.dot(off, off)
        if not k:
            best, nearest = [*map(SX, numbers), u], gap
            continue
        here = gap < nearest
        tried: list[SX] = [*map(SX, numbers), u]
        best = [ca.if_else(here, new, old) for new, old in zip(tried, best, strict=True)]
        nearest = ca.if_else(here, gap, nearest)
    for _ in range(ROUNDS):
        for _ in range(STEPS):
            best[-1] = refine_foot(best, p)
        best = _with_piece(curve, best[-1])
    return ca.vertcat(*best)


def _chord(of: Sequence[float], h: float) -> float:
    """Mean slope over [0, h] of the cubic with coefficients ``of``."""
    return of[1] + h * (of[2] + h * of[3])


def _with_piece(curve: Curve, u: SX) -> list[SX]:
    """The foot (``coupling_joint_data.FOOT``) at parameter u. On a closed curve, u is reduced to one period."""
    if curve.around:
        u = u - curve.around * ca.floor(u / curve.around)
    return [*numbers_of_piece([(piece.start, piece.way, *piece.e2, *piece.e3) for piece in curve.pieces], u), u]


def numbers_of_piece(pieces: Sequence[tuple[float, ...]], x: SX) -> list[SX]:
    """The numbers of the piece at x, or of the first piece if x is before the first piece. The first number of a piece is its
    start."""
    out = [SX(0)] * len(pieces[0])
    begun = [SX(1), *[x >= piece[0] for piece in pieces[1:]], SX(0)]
    for k, numbers in enumerate(pieces):
        here = ca.logic_and(begun[k], ca.logic_not(begun[k + 1]))
        out = [of + ca.if_else(here, number, 0) for of, number in zip(out, numbers, strict=True)]
    return out
