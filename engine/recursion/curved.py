"""The row of a point that stays on a curve in a plane of the inboard part (METHOD, "Points on curves")."""

from __future__ import annotations

import casadi as ca

from engine.recursion.feet import measured, read, refined
from engine.recursion.following import Touch
from engine.recursion.rows import Cut, Row, point_velocity, pushed
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, cross

REFINED = 2
"""Steps of Newton's method behind the given foot: the first makes its derivative right, the second that of the derivative."""


def spot(c: Cut) -> SX:
    """The point as its curve's plane sees it (2), m."""
    return ca.vertcat(*(ca.dot(c.Ein[:, k], c.s) for k in (1, 2)))


def curve_row(sym: Symbols, c: Cut) -> tuple[Row, Row, SX, SX]:
    """The row of a cut joint whose outboard point stays on a curve; its freedom, as a row of which only rate, wrenches and ξ count:
    how fast the point slides along the curve; the frame of the contact in the world: e1, the normal (to the right of the way along
    the curve, seen against e1) and the way (3×3); and how far along the curve it is, m."""
    at, along = _touch(sym, c)
    return pushed(c, at.phi, at.n, at.arm_in, at.arm_out), pushed(c, SX(0), at.t, at.arm_in, at.arm_out), at.frame, along


def _touch(sym: Symbols, c: Cut) -> tuple[Touch, SX]:
    w, (e1, e2, e3) = c.inb.omega, (c.Ein[:, k] for k in range(3))
    p, seen = spot(c), point_velocity(c) - cross(w, c.s)
    rate = ca.vertcat(ca.dot(e2, seen), ca.dot(e3, seen))
    foot = ca.vertsplit(ca.densify(sym.foot(c.joint, p)))
    for _ in range(REFINED):
        foot[-1] = refined(foot, p)
    at, way, bend = read(foot)
    gap, square = p - at, ca.dot(way, way)
    size = ca.sqrt(square)
    moved = ca.dot(rate, way) / (square - ca.dot(gap, bend))
    turning = w + (way[0] * bend[1] - way[1] * bend[0]) / square * moved * e1
    n, t = (way[1] * e2 - way[0] * e3) / size, (way[0] * e2 + way[1] * e3) / size
    own, carried = (c.c_out, cross(c.out.omega, c.c_out)), c.out.rdot - c.inb.rdot
    arm_in, phi = (c.c_in + c.s, carried + own[1]), (gap[0] * way[1] - gap[1] * way[0]) / size
    return Touch(phi, (n, cross(turning, n)), (t, cross(turning, t)), arm_in, own, ca.horzcat(e1, n, t)), measured(foot)
