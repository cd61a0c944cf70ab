"""What ties two parts that other joints carry: wheels that roll on each other, the curve of a cam, a freedom that
follows another."""

from __future__ import annotations

from dataclasses import dataclass

from engine.system.leaves import Leaf


@dataclass(frozen=True)
class Wheels:
    """Of two wheels that roll on each other: module (pitch diameter over teeth), signed numbers of teeth of the inboard and the
    outboard one, and what ``joints.rolling.phase`` is where they mesh."""

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
