"""Latches: what their hooks do to a freedom, and how far hooks are from falling and lifting (METHOD, "Latches")."""

from __future__ import annotations

import casadi as ca

from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX
from engine.system.structure import Latch

LIFTED = 0.5
"""Value of its release above which a hook is lifted."""

SLACK = 5e-13
"""m or rad before it has been passed at which a hook falls: what starts just there is caught. Half of what ends of stops are found
to."""

BEYOND = 2e-12
"""m or rad before a tooth at which it counts as passed when its hook falls: twice what ends of stops are found to, so that a tooth
is never passed twice."""


def tooth(sym: Symbols, x: Latch, hook: SX) -> SX:
    """Where the tooth is that a hook is on: the first for one that is up. hook: which, from 1; 0: up."""
    at = sym.leaf(x.at)
    return at + x.side * sym.leaf(x.pitch) * (ca.fmax(hook, 1) - 1) if toothed(x) else at


def toothed(x: Latch) -> bool:
    """Whether a latch may have several teeth; their pitch is 0 where it has but one."""
    return not (isinstance(x.pitch, float) and x.pitch == 0.0)


def force(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX, rate: SX) -> SX:
    """Force of a hook on the outboard part: as of a stop, while it is down and pressed."""
    give = ca.fmax(1 - sym.leaf(x.damping) * x.side * rate, 0)
    return elastic(sym, x, flags, q) * give


def elastic(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX) -> SX:
    """Elastic part of that."""
    return _pressed(x, flags) * sym.leaf(x.stiffness) * (tooth(sym, x, flags[0]) - q)


def potential(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX) -> SX:
    """Energy that a pressed hook stores."""
    return 0.5 * _pressed(x, flags) * sym.leaf(x.stiffness) * (tooth(sym, x, flags[0]) - q) ** 2


def _pressed(x: Latch, flags: tuple[SX, SX]) -> SX:
    return (ca.fmin(flags[0], 1) if toothed(x) else flags[0]) * flags[1]


def depths(sym: Symbols, x: Latch, hook: SX, q: SX, release: SX) -> tuple[SX, SX]:
    """(whether a hook that is up falls, or one that is down stays, on its tooth; how deep it is pressed): positive where it does.
    Of one that is up the second is the number of the tooth that it would fall on, with a minus."""
    depth, lifted = x.side * (tooth(sym, x, hook) - q), release - LIFTED
    stays, falls = ca.fmin(-lifted, sym.leaf(x.holds) / sym.leaf(x.stiffness) - depth), ca.fmin(-lifted, SLACK - depth)
    first = ca.SX(1)
    if toothed(x):
        pitch = sym.leaf(x.pitch)
        stays = ca.if_else(pitch > 0, ca.fmin(stays, depth + pitch), stays)
        past = ca.floor((BEYOND - x.side * (sym.leaf(x.at) - q)) / ca.if_else(pitch > 0, pitch, 1))
        first = ca.if_else(pitch > 0, 1 + ca.fmax(past, 0), 1)
    return ca.if_else(hook > 0.5, stays, falls), ca.if_else(hook > 0.5, depth, -first)
