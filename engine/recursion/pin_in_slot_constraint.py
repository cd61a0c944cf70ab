"""Constraint of a pin in a slot (theory, "Pins in slots"): the gap between the pin and the nearest wall of the slot."""

from __future__ import annotations

import math

import casadi as ca

from trunnion.recursion.cut_joint_frames_and_rows import Cut, Moving, Row, force_row, point_velocity
from trunnion.recursion.masses_and_forces import TINY
from trunnion.recursion.point_on_curve_constraint import CurveContact, curve_contact, rim
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross


def slot_axes(sym: Symbols, c: Cut) -> tuple[SX, SX]:
    """Axes e2 and e3 of the slot nearest to the pin, among equal slots around e1."""
    assert c.joint.slot is not None
    x, y = ca.dot(c.Ein[:, 1], c.s), ca.dot(c.Ein[:, 2], c.s)
    pitch = 2.0 * math.pi / sym.leaf(c.joint.slot.repeated)
    turned = pitch * ca.floor(ca.atan2(y, x) / pitch + 0.5)
    cosine, sine = ca.cos(turned), ca.sin(turned)
    return cosine * c.Ein[:, 1] + sine * c.Ein[:, 2], cosine * c.Ein[:, 2] - sine * c.Ein[:, 1]


def slot_row(sym: Symbols, c: Cut) -> tuple[Row, Row, SX, SX]:
    """The row of the gap, the freedom, the contact frame, and the distance of the pin inside the mouths, m (negative: the pin has
    left the slot).

    The freedom is sliding along the wall: a ``Row`` of which only the rate, the wrenches and ξ are used. The columns of the
    frame (3×3, world) are e1, the normal n from the wall towards the middle of the slot, and t = e1 × n."""
    assert c.joint.slot is not None
    assert c.joint.curve is not None
    at = curve_contact(sym, c, slot_axes(sym, c))
    start, end, length = (sym.leaf(x) for x in (*c.joint.slot.mouths, c.joint.curve.length))
    past = ca.fmax(at.way - length, 0) * (1 - end) + ca.fmin(at.way, 0) * (1 - start)
    inside = ca.fmin(ca.if_else(start > 0, at.way, length), ca.if_else(end > 0, length - at.way, length))
    size, n, t = _offset(c, at, past)
    arms = rim(sym, c, n, at.touch)
    row = force_row(c, sym.leaf(c.joint.slot.play) - size, n, *arms)
    return row, force_row(c, SX(0), t, *arms), ca.horzcat(c.Ein[:, 0], n[0], t[0]), inside


def _offset(c: Cut, at: CurveContact, past: SX) -> tuple[SX, Moving, Moving]:
    """Distance of the pin from the nearest point of the curve, m; n and t with their rates. past: distance beyond an end without a
    mouth, m (negative before the start). Beyond an end, n turns with the line from the end to the pin."""
    e1, across, beyond = c.Ein[:, 0], at.touch.phi, past != 0
    far = ca.if_else(beyond, ca.sqrt(past * past + across * across + TINY), 1)
    side = ca.if_else(across < 0, 1, -1)
    right, along = at.touch.n[0], at.touch.t[0]
    n = ca.if_else(beyond, -(past * along + across * right) / far, side * right)
    seen = point_velocity(c) - cross(c.inb.omega, c.s)
    turning = ca.if_else(beyond, c.inb.omega - ca.dot(e1, cross(n, seen)) / far * e1, at.turning)
    t = cross(e1, n)
    return ca.if_else(beyond, far, ca.fabs(across)), (n, cross(turning, n)), (t, cross(turning, t))
