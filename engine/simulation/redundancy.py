"""Which joints' reactions are not unique: the mechanism's motion is, but redundant loops leave some reactions open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.simulation.block import Block

SHARE = 1e-6
"""A joint takes part in an open direction when its share of that (unit) direction exceeds this; round-off is 1e-12 at most."""


@dataclass(frozen=True)
class Redundancy:
    """Which reactions are not unique. count: how many independent reaction patterns the motion leaves open; joints: names of
    the joints whose reactions are therefore not unique; rubbing: those among them that have friction, which then, and the motion
    with it, is not unique for rigid bodies either. Reported are the reactions that are smallest in the bodies' own metric, or,
    where joints on loops rub, the limit of stiff contacts (METHOD, "Redundant loops")."""

    count: int
    joints: tuple[str, ...] = ()
    rubbing: tuple[str, ...] = ()


def redundancy(block: Block) -> Redundancy:
    """Redundancy at the block's present state."""
    if not block.kernel.sizes["rows"]:
        return Redundancy(0)
    open_directions = block.redundancy()
    names, at = [], 0
    for name, rows in block.kernel.facts["loop_rows"]:
        part = open_directions[at : at + rows]
        at += rows
        if part.size and np.abs(part).max() > SHARE:
            names.append(name)
    rubbing = block.kernel.facts["rubbing"] if block.kernel.sizes["nkappa"] else ()  # else no open reaction presses on what rubs
    return Redundancy(open_directions.shape[1], tuple(names), tuple(n for n in names if n in rubbing))


def redundancy_notes(r: Redundancy) -> list[str]:
    """The line a user is told when reactions are not unique; none when they all are."""
    if r.count == 0:
        return []
    times = "once" if r.count == 1 else f"{r.count} times"
    joints, redundant = ", ".join(r.joints), f"the loops are redundant {times}"
    if not r.rubbing:
        return [f"{redundant}: the motion is unique, the reactions of {joints} are not (smallest reported)"]
    rubbing = ", ".join(r.rubbing)
    return [
        f"{redundant}: rigid bodies leave the reactions of {joints} open, and with them the friction of {rubbing} and the motion; "
        "reported is the limit of stiff contacts, all of one radial stiffness"
    ]
