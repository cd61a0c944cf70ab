"""Constraint of a point on a curve in a plane of the inboard part (theory, "Points on curves")."""

from __future__ import annotations

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.recursion.cam_follower_constraint import FollowerContact, inside_ends
from trunnion.recursion.curve_foot_point import arc_length, evaluate_curve, refine_foot
from trunnion.recursion.cut_joint_frames_and_rows import Cut, Moving, Row, force_row, point_velocity
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross

REFINED = 2
"""Number of Newton steps from the given foot. After one step, the first derivative of the foot is correct; after two steps, the
second derivative, too."""


@dataclass
class CurveContact:
    """Contact of a point with a curve. way: arc length at the foot, m. turning: angular velocity of the contact frame."""

    touch: FollowerContact
    way: SX
    turning: SX


def spot(axes: tuple[SX, SX], c: Cut) -> SX:
    """Position of the outboard point along the axes e2 and e3 of the curve (2), m."""
    return ca.vertcat(*(ca.dot(axis, c.s) for axis in axes))


def curve_row(sym: Symbols, c: Cut) -> tuple[Row, Row, SX, SX, SX]:
    """Constraint row, freedom, contact frame, position along the curve (m) and ``inside_ends`` of a cut joint whose outboard
    point stays on a curve.

    The freedom is sliding along the curve: a ``Row`` of which only the rate, the wrenches and ξ are used. The columns of the
    frame (3×3, world) are e1, the normal n, and the direction t of increasing parameter. Seen along −e1, n is to the right of t."""
    assert c.joint.curve is not None
    found = curve_contact(sym, c, (c.Ein[:, 1], c.Ein[:, 2]))
    at, arms = found.touch, rim(sym, c, found.touch.n, found.touch)
    inside = inside_ends(sym, c, ca.fmin(found.way, sym.leaf(c.joint.curve.length) - found.way), at.phi)
    return force_row(c, at.phi, at.n, *arms), force_row(c, SX(0), at.t, *arms), at.frame, found.way, inside


def rim(sym: Symbols, c: Cut, n: Moving, at: FollowerContact) -> tuple[Moving, Moving]:
    """Arms of the contact force, with rates, at the rim of a roller around the point. n: direction from the wall to the point."""
    assert c.joint.curve is not None
    r = sym.leaf(c.joint.curve.roller)
    return (at.arm_in[0] - r * n[0], at.arm_in[1] - r * n[1]), (at.arm_out[0] - r * n[0], at.arm_out[1] - r * n[1])


def curve_contact(sym: Symbols, c: Cut, axes: tuple[SX, SX]) -> CurveContact:
    """Contact of the outboard point with a curve. axes: e2 and e3 of the curve."""
    w, e1, (e2, e3) = c.inb.omega, c.Ein[:, 0], axes
    p, seen = spot(axes, c), point_velocity(c) - cross(w, c.s)
    rate = ca.vertcat(ca.dot(e2, seen), ca.dot(e3, seen))
    foot = ca.vertsplit(ca.densify(sym.foot(c.joint, p)))
    for _ in range(REFINED):
        foot[-1] = refine_foot(foot, p)
    at, way, bend = evaluate_curve(foot)
    gap, square = p - at, ca.dot(way, way)
    size = ca.sqrt(square)
    moved = ca.dot(rate, way) / (square - ca.dot(gap, bend))
    turning = w + (way[0] * bend[1] - way[1] * bend[0]) / square * moved * e1
    n, t = (way[1] * e2 - way[0] * e3) / size, (way[0] * e2 + way[1] * e3) / size
    own, carried = (c.c_out, cross(c.out.omega, c.c_out)), c.out.rdot - c.inb.rdot
    arm_in, phi = (c.c_in + c.s, carried + own[1]), (gap[0] * way[1] - gap[1] * way[0]) / size
    touch = FollowerContact(phi, (n, cross(turning, n)), (t, cross(turning, t)), arm_in, own, ca.horzcat(e1, n, t))
    return CurveContact(touch, arc_length(foot), turning)
