"""The row of what follows a cam (METHOD, "Cams"): a point stays on its curve, or a face on what bears it.

With k the normal where they touch, x the arms of that force from both parts' origins, the rate is k·(v_out − v_in); ξ is its rate
while Ż = 0."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from engine.recursion.rows import Cut, Moving, Row, point_velocity, pushed
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, cross


@dataclass
class Seen:
    """A direction as the cam sees it, with its rate: its angle, its length across the cam's axis, and its part along e2 and e3 of
    the frame that angles are measured in (3 each)."""

    angle: Moving
    length: Moving
    e2: SX
    e3: SX


def bearing(sym: Symbols, c: Cut) -> SX:
    """The angle by which a cam's curve is read, rad within ±π."""
    return _seen(sym, c).angle[0]


@dataclass
class Touch:
    """Where a follower touches a cam. phi: how far it is off the curve; n, t: the normal towards the follower and the way its
    surface slides; arms of the force from both parts' origins; each with its rate. frame: the cam's axis, n and t (3×3)."""

    phi: SX
    n: Moving
    t: Moving
    arm_in: Moving
    arm_out: Moving
    frame: SX


def following_row(sym: Symbols, c: Cut) -> tuple[Row, Row, SX]:
    """The row of a cut joint whose outboard part follows a cam; its freedom, as a row of which only rate, wrenches and ξ count: how
    fast the follower's surface slides along the cam's; and the frame of the contact in the world: the cam's axis, the normal
    towards the follower, and the way it slides (3×3)."""
    seen = _seen(sym, c)
    curve = sym.curve(c.joint, seen.angle[0])
    at = (_point if c.joint.kind.follows == "point" else _face)(sym, c, seen, curve)
    arms = at.arm_in, at.arm_out
    return pushed(c, at.phi, at.n, *arms), pushed(c, SX(0), at.t, *arms), at.frame


def _seen(sym: Symbols, c: Cut) -> Seen:
    assert c.joint.profile is not None
    cosine, sine = (sym.leaf(x) for x in c.joint.profile.middle)
    e2, e3 = cosine * c.Ein[:, 1] + sine * c.Ein[:, 2], cosine * c.Ein[:, 2] - sine * c.Ein[:, 1]
    w = c.inb.omega
    if c.joint.kind.follows == "point":
        v, rate = c.s, point_velocity(c) - cross(w, c.s)
    else:
        v = c.Eout[:, 0]
        rate = cross(c.out.omega - w, v)
    x, y, xdot, ydot = (ca.dot(e, of) for of in (v, rate) for e in (e2, e3))
    length = ca.sqrt(x * x + y * y)
    angle = (ca.atan2(y, x), (x * ydot - y * xdot) / (length * length))
    return Seen(angle, (length, (x * xdot + y * ydot) / length), e2, e3)


def _frame(c: Cut, seen: Seen, angle: Moving) -> tuple[SX, Moving, Moving]:
    """A frame whose e1 is the cam's and whose e2 is at an angle in the cam; e2 and e3 with their rates."""
    a = c.Ein[:, 0]
    cosine, sine = ca.cos(angle[0]), ca.sin(angle[0])
    n, t = cosine * seen.e2 + sine * seen.e3, cosine * seen.e3 - sine * seen.e2
    turning = c.inb.omega + angle[1] * a
    return ca.horzcat(a, n, t), (n, cross(turning, n)), (t, cross(turning, t))


def _point(sym: Symbols, c: Cut, seen: Seen, curve: tuple[SX, SX, SX]) -> Touch:
    """A point whose distance from the cam's axis is a function of its angle there presses across the curve it goes along; a roller
    around it touches that much nearer to the axis."""
    (angle, turned), (length, spread), (r, slope, bend) = seen.angle, seen.length, curve
    square = length * length + slope * slope
    lean = (ca.atan2(slope, length), (bend * turned * length - slope * spread) / square)
    E, n, t = _frame(c, seen, (angle - lean[0], turned - lean[1]))
    assert c.joint.profile is not None
    roller = sym.leaf(c.joint.profile.roller)
    own, carried = (c.c_out, cross(c.out.omega, c.c_out)), c.out.rdot - c.inb.rdot
    arm_in = (c.c_in + c.s - roller * n[0], carried + own[1] - roller * n[1])
    arm_out = (own[0] - roller * n[0], own[1] - roller * n[1])
    return Touch((length - r) * length / ca.sqrt(square), n, t, arm_in, arm_out, E)


def _face(sym: Symbols, c: Cut, seen: Seen, curve: tuple[SX, SX, SX]) -> Touch:
    """A flat face whose distance from the cam's axis is a function of the angle of its normal: where it touches is the slope of
    that away from the axis."""
    (h, slope, bend), turned = curve, seen.angle[1]
    E, n, t = _frame(c, seen, seen.angle)
    foot = h * n[0] + slope * t[0]
    moved = slope * turned * n[0] + h * n[1] + bend * turned * t[0] + slope * t[1]
    own = c.c_in, cross(c.inb.omega, c.c_in)
    arm_in = (own[0] + foot, own[1] + moved)
    arm_out = (c.c_out - c.s + foot, own[1] + moved + c.inb.rdot - c.out.rdot)
    return Touch(ca.dot(n[0], c.s) - h, n, t, arm_in, arm_out, E)
