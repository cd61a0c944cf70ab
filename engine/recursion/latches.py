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


def force(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX, rate: SX) -> SX:
    """Force of a hook on the outboard part: as of a stop, while it is down and pressed."""
    give = ca.fmax(1 - sym.leaf(x.damping) * x.side * rate, 0)
    return elastic(sym, x, flags, q) * give


def elastic(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX) -> SX:
    """Elastic part of that."""
    return flags[0] * flags[1] * sym.leaf(x.stiffness) * (sym.leaf(x.at) - q)


def potential(sym: Symbols, x: Latch, flags: tuple[SX, SX], q: SX) -> SX:
    """Energy that a pressed hook stores."""
    return 0.5 * flags[0] * flags[1] * sym.leaf(x.stiffness) * (sym.leaf(x.at) - q) ** 2


def depths(sym: Symbols, x: Latch, hook: SX, q: SX, release: SX) -> tuple[SX, SX]:
    """(whether a hook that is up falls, or one that is down stays; how deep it is pressed): positive where it does."""
    depth, lifted = x.side * (sym.leaf(x.at) - q), release - LIFTED
    stays = ca.fmin(-lifted, sym.leaf(x.holds) / sym.leaf(x.stiffness) - depth)
    return ca.if_else(hook > 0.5, stays, ca.fmin(-lifted, SLACK - depth)), ca.if_else(hook > 0.5, depth, -1)
