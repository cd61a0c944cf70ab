"""Latches: force of the hook on a freedom, and event functions for falling and lifting of the hook (theory, "Latches")."""

from __future__ import annotations

import casadi as ca

from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import Latch

LIFTED = 0.5
"""A hook is lifted while the release signal is above this value."""

SLACK = 5e-13
"""A hook falls when the part is this distance before the tooth, m or rad, so that the hook catches a part that starts at the tooth.
The distance is half of the tolerance of end stops."""

BEYOND = 2e-12
"""When a hook falls, a tooth counts as passed if the part is within this distance of the tooth, m or rad. The distance is twice the
tolerance of end stops, so that no tooth is passed twice."""


def tooth(sym: Symbols, x: Latch, hook: SX) -> SX:
    """Position of the tooth on which the hook is. hook: number of the tooth, from 1; 0 (hook up) gives the position of the first
    tooth."""
    at = sym.leaf(x.at)
    return at + x.side * sym.leaf(x.pitch) * (ca.fmax(hook, 1) - 1) if toothed(x) else at


def toothed(x: Latch) -> bool:
    """Whether a latch may have several teeth. A constant pitch of 0 means a single tooth."""
    return not (isinstance(x.pitch, float) and x.pitch == 0.0)


def force(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX, rate: SX) -> SX:
    """Force of a hook on the outboard part while the hook is down and pressed, by the force law of an end stop."""
    give = ca.fmax(1 - sym.leaf(x.damping) * x.side * rate, 0)
    return elastic(sym, x, flags, q) * give


def elastic(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX) -> SX:
    """Elastic part of ``force``."""
    return _pressed(x, flags) * sym.leaf(x.stiffness) * (tooth(sym, x, flags[0]) - q)


def potential(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX) -> SX:
    """Elastic energy of a pressed hook, J."""
    return 0.5 * _pressed(x, flags) * sym.leaf(x.stiffness) * (tooth(sym, x, flags[0]) - q) ** 2


def _pressed(x: Latch, flags: tuple[SX, SX]) -> SX:
    return (ca.fmin(flags[0], 1) if toothed(x) else flags[0]) * flags[1]


def depths(sym: Symbols, x: Latch, hook: SX, q: SX, release: SX) -> tuple[SX, SX, SX]:
    """Three event functions of a hook.

    1. Hook up: positive where the hook falls. Hook down: positive where the hook stays down.
    2. Hook up: minus the number of the tooth on which the hook would fall. Hook down: depth by which the hook is pressed.
    3. Release signal minus LIFTED. Only the third function crosses zero smoothly when the signal releases the hook; steps end at
    its zeros."""
    depth, lifted = x.side * (tooth(sym, x, hook) - q), release - LIFTED
    stays, falls = ca.fmin(-lifted, sym.leaf(x.holds) / sym.leaf(x.stiffness) - depth), ca.fmin(-lifted, SLACK - depth)
    first = ca.SX(1)
    if toothed(x):
        pitch = sym.leaf(x.pitch)
        stays = ca.if_else(pitch > 0, ca.fmin(stays, depth + pitch), stays)
        past = ca.floor((BEYOND - x.side * (sym.leaf(x.at) - q)) / ca.if_else(pitch > 0, pitch, 1))
        first = ca.if_else(pitch > 0, 1 + ca.fmax(past, 0), 1)
    return ca.if_else(hook > 0.5, stays, falls), ca.if_else(hook > 0.5, depth, -first), lifted
