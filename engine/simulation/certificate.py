"""What certifies a result: numbers that say how far its friction can be trusted, and whether it is the only answer."""

from __future__ import annotations

from dataclasses import dataclass

from engine.integrators import AUTO
from engine.simulation.block import Block
from engine.simulation.pairs import slider_names
from engine.simulation.redundancy import Redundancy
from engine.system.structure import System


@dataclass(frozen=True)
class Certificate:
    """What these numbers say, and what they do not: METHOD, "Certificate".

    contraction: largest factor by which fixed-point iteration of the complement equations contracts (start, events, end); below
    1 no other root is near. roots: roots of these equations found at start and end. complement: their largest relative residual.
    indeterminate: (time, joint) of the first decision between sticking and slipping that several answers satisfied, or None.
    time_stepped: when events first accumulated so that time stepping took over, or None.
    redundancy: independent reaction patterns the motion leaves open; not_unique: joints whose reactions are therefore a choice."""

    contraction: float = 0.0
    roots: tuple[int, int] = (1, 1)
    complement: float = 0.0
    indeterminate: tuple[float, str] | None = None
    redundancy: int = 0
    not_unique: tuple[str, ...] = ()
    time_stepped: float | None = None


def certificate(block: Block, system: System, roots_at_start: int, open_reactions: Redundancy) -> Certificate:
    """The certificate of a run that has come to its end."""
    c = block.certificate()
    several = (c.open_time, slider_names(system)[int(c.open_pair)][0]) if c.open_time >= 0.0 else None
    roots = (roots_at_start, block.roots() if system.neta else 1)
    return Certificate(c.contraction, roots, c.complement, several, open_reactions.count, open_reactions.joints,
                       c.stepped if c.stepped >= 0.0 else None)


def certificate_notes(c: Certificate) -> list[str]:
    """Lines for the user: what in the certificate limits how far the result can be trusted."""
    out = []
    if c.indeterminate:
        time, joint = c.indeterminate
        way = "could both stick and slip, or slip either way; sticking was preferred"
        out.append(f"indeterminate at t = {time:.6g} s: joint {joint} {way}")
    if c.time_stepped is not None:
        method = AUTO.accumulating
        what = f"time stepping ({method.name}, order {method.order}) took over while they did"
        out.append(f"events accumulated at t = {c.time_stepped:.6g} s: {what}")
    if max(c.roots) > 1:
        out.append(f"the complement equations have {max(c.roots)} roots: the one continued from zero friction was followed")
    return out
