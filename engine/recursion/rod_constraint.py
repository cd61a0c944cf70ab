"""Constraint of a rod (theory, "Rods"): the distance of two points is the rod's length."""

from __future__ import annotations

import casadi as ca

from trunnion.recursion.cut_joint_frames_and_rows import Cut, Row, force_row, point_velocity
from trunnion.recursion.masses_and_forces import TINY
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import cross


def rod_row(sym: Symbols, c: Cut) -> Row:
    """Constraint row of a rod. k is the unit vector from the inboard to the outboard point; the multiplier is the rod's
    compression, N."""
    assert c.joint.length is not None
    distance, velocity = ca.sqrt(ca.dot(c.s, c.s) + TINY), point_velocity(c)
    k = c.s / distance
    kdot = (velocity - k * ca.dot(k, velocity)) / distance
    arms = (c.c_in, cross(c.inb.omega, c.c_in)), (c.c_out, cross(c.out.omega, c.c_out))
    return force_row(c, distance - sym.leaf(c.joint.length), (k, kdot), *arms)
