"""What ties two parts that other joints carry: wheels that roll on each other, the curve of a cam, a curve that a point
stays on, a freedom that follows another."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.polynomial.legendre import leggauss

from trunnion.system.structure.parameter_table import Leaf


@dataclass(frozen=True)
class Wheels:
    """Of two wheels that roll on each other: module (pitch diameter over teeth), signed numbers of teeth of the inboard and the
    outboard one, and what ``elements.joints.wheel_pairs.phase`` is where they mesh."""

    module: Leaf
    teeth: tuple[Leaf, Leaf]
    phase: Leaf


@dataclass(frozen=True)
class Profile:
    """Of a cam: how far from its axis its follower is, by angle about it, in pieces. middle: (cosine, sine) of the angle that the
    others are measured from, rad within ±π; starts: where pieces begin; pieces: for each four coefficients, of powers of the angle
    from there. The first and the last piece go on beyond. roller: radius of the roller that follows it, m."""

    middle: tuple[Leaf, Leaf]
    roller: Leaf
    starts: tuple[float, ...]
    pieces: tuple[tuple[float, float, float, float], ...]


NODES, WEIGHTS = (tuple(map(float, x)) for x in leggauss(20))
"""Gauss' points by which a piece of a curve is measured: of one that turns by a right angle to round-off."""
ENDLESS = 1e300
"""Where the straight pieces beyond the ends of a curve end."""
FOOT = 11
"""Numbers of a foot on a curve: where its piece starts, the way there, four coefficients each along e2 and e3, and its
own parameter."""


@dataclass(frozen=True)
class Piece:
    """Of a curve: where it starts, and ends, by the parameter of its spline; the way to its start along the curve, m; four
    coefficients each of powers of the parameter from there, along e2 and e3, m."""

    start: float
    end: float
    way: float
    e2: tuple[float, ...]
    e3: tuple[float, ...]


@dataclass(frozen=True)
class Curve:
    """A curve in a plane, in pieces. An open one begins and ends with straight pieces, whose ends are infinite; around: how long a
    closed one is by its parameter, 0 of an open one."""

    pieces: tuple[Piece, ...]
    around: float


@dataclass(frozen=True)
class Mimic:
    """Of the freedom of a tree joint that follows that of another: both joints by their places in the tree, the bodies of the one
    that leads, whether the one that follows turns; q_follower = ratio · q_leader + offset."""

    follower: int
    leader: int
    inb: int
    out: int
    turns: bool
    ratio: Leaf
    offset: Leaf
