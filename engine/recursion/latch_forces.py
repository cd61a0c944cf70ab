"""Latches: force of the hook on a freedom; distance of the hook from falling and lifting (theory, "Latches")."""

from __future__ import annotations

import casadi as ca

from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import Latch

LIFTED = 0.5
"""Release value above which a hook is lifted."""

SLACK = 5e-13
"""A hook falls this early, m or rad, so that it catches a part that starts at the tooth. Half of the tolerance of stop ends."""

BEYOND = 2e-12
"""When a hook falls, a tooth this near counts as passed, m or rad. Twice the tolerance of stop ends, so that no tooth is passed
twice."""


def tooth(sym: Symbols, x: Latch, hook: SX) -> SX:
    """Position of the hook's tooth. hook: number of the tooth, from 1; 0: up, then the first."""
    at = sym.leaf(x.at)
    return at + x.side * sym.leaf(x.pitch) * (ca.fmax(hook, 1) - 1) if toothed(x) else at


def toothed(x: Latch) -> bool:
    """Whether a latch may have several teeth. A constant pitch 0 means one."""
    return not (isinstance(x.pitch, float) and x.pitch == 0.0)


def force(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX, rate: SX) -> SX:
    """Force of a hook on the outboard part while it is down and pressed, as of an end stop."""
    give = ca.fmax(1 - sym.leaf(x.damping) * x.side * rate, 0)
    return elastic(sym, x, flags, q) * give


def elastic(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX) -> SX:
    """Elastic part of ``force``."""
    return _pressed(x, flags) * sym.leaf(x.stiffness) * (tooth(sym, x, flags[0]) - q)


def potential(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX) -> SX:
    """Energy of a pressed hook."""
    return 0.5 * _pressed(x, flags) * sym.leaf(x.stiffness) * (tooth(sym, x, flags[0]) - q) ** 2


def _pressed(x: Latch, flags: tuple[SX, SX]) -> SX:
    return (ca.fmin(flags[0], 1) if toothed(x) else flags[0]) * flags[1]


def depths(sym: Symbols, x: Latch, hook: SX, q: SX, release: SX) -> tuple[SX, SX, SX]:
    """(distance from falling of a hook that is up, or from lifting of one that is down: positive where it falls or stays; depth by
    which the hook is pressed; how far the signal lifts the hook). For a hook that is up, the second is minus the number of the
    tooth on which it would fall. The third alone has smooth zeros where the signal releases the hook, at which steps end."""
    depth, lifted = x.side * (tooth(sym, x, hook) - q), release - LIFTED
    stays, falls = ca.fmin(-lifted, sym.leaf(x.holds) / sym.leaf(x.stiffness) - depth), ca.fmin(-lifted, SLACK - depth)
    first = ca.SX(1)
    if toothed(x):
        pitch = sym.leaf(x.pitch)
        stays = ca.if_else(pitch > 0, ca.fmin(stays, depth + pitch), stays)
        past = ca.floor((BEYOND - x.side * (sym.leaf(x.at) - q)) / ca.if_else(pitch > 0, pitch, 1))
        first = ca.if_else(pitch > 0, 1 + ca.fmax(past, 0), 1)
    return ca.if_else(hook > 0.5, stays, falls), ca.if_else(hook > 0.5, depth, -first), lifted
