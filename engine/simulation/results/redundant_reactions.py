"""Reactions that redundant constraints of loops do not determine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trunnion.simulation.runtime_interface.simulation_block import Block

SHARE = 1e-6
"""Least component of a joint in an open direction (unit vector); round-off is 1e-12 at most."""


@dataclass(frozen=True)
class Redundancy:
    """Reactions that are not unique (theory, "Redundant loops").

    Minimum-norm reactions in the bodies' metric are reported; with friction in the loops, the limit of stiff contacts.

    Attributes:
        count: number of independent reaction patterns that the motion does not determine.
        joints: joints whose reactions are not unique.
        rubbing: joints among them with friction, whose friction and motion are not unique for rigid bodies.
    """

    count: int
    joints: tuple[str, ...] = ()
    rubbing: tuple[str, ...] = ()


def redundancy(block: Block) -> Redundancy:
    """The redundancy at the block's present state."""
    if not block.kernel.sizes["rows"]:
        return Redundancy(0)
    open_directions = block.redundancy()
    names, at = [], 0
    for name, rows in block.kernel.facts["loop_rows"]:
        part = open_directions[at : at + rows]
        at += rows
        if part.size and np.abs(part).max() > SHARE:
            names.append(name)
    rubbing = block.kernel.facts["rubbing"] if block.kernel.sizes["nkappa"] else ()
    return Redundancy(open_directions.shape[1], tuple(names), tuple(n for n in names if n in rubbing))


def redundancy_notes(r: Redundancy) -> list[str]:
    """A note about reactions that are not unique; none without any."""
    if r.count == 0:
        return []
    joints, redundant = ", ".join(r.joints), f"{r.count} redundant constraint{'s' * (r.count > 1)}"
    if not r.rubbing:
        return [f"{redundant}: the motion is unique, but the reactions of {joints} are not; those of least norm are reported"]
    return [
        f"{redundant}: for rigid bodies neither the reactions of {joints}, nor the friction of {', '.join(r.rubbing)}, nor the "
        "motion is unique; the solution for stiff contacts that all have the same radial stiffness is reported"
    ]
