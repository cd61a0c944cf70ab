"""Reactions that redundant constraints of loops do not determine."""

from __future__ import annotations

from dataclasses import dataclass

from trunnion.simulation.runtime_interface.simulation_block import Block

SHARE = 1e-6
"""Consider the reaction patterns (unit vectors) that the motion does not determine. A joint's reactions are not unique if one of
these patterns has a component of at least this size in the joint. Round-off is at most 1e-12."""


@dataclass(frozen=True)
class Redundancy:
    """Reactions that are not unique (theory, "Redundant loops").

    Without friction in the loops, the reported reactions have the minimum norm in the metric of the bodies' inertia. With friction
    in the loops, they are the limit for stiff contacts.

    Attributes:
        count: number of independent reaction patterns that the motion does not determine.
        joints: joints whose reactions are not unique.
        rubbing: those of ``joints`` that have friction. For rigid bodies, their friction and the motion are not unique.
    """

    count: int
    joints: tuple[str, ...] = ()
    rubbing: tuple[str, ...] = ()


def redundancy(block: Block) -> Redundancy:
    """The redundancy at the current state of the block."""
    if not block.kernel.sizes["rows"]:
        return Redundancy(0)
    count, share = block.redundancy()
    names, at = [], 0
    for name, rows in block.kernel.facts["loop_rows"]:
        if rows and share[at : at + rows].max() > SHARE:
            names.append(name)
        at += rows
    rubbing = block.kernel.facts["rubbing"] if block.kernel.sizes["nkappa"] else ()
    return Redundancy(count, tuple(names), tuple(n for n in names if n in rubbing))


def redundancy_notes(r: Redundancy) -> list[str]:
    """A note about reactions that are not unique; empty if all reactions are unique."""
    if r.count == 0:
        return []
    joints, redundant = ", ".join(r.joints), f"{r.count} redundant constraint{'s' * (r.count > 1)}"
    if not r.rubbing:
        return [f"{redundant}: the motion is unique, but the reactions of {joints} are not; minimum-norm reactions are reported"]
    return [
        f"{redundant}: for rigid bodies, the reactions of {joints}, the friction of {', '.join(r.rubbing)} and the motion are not "
        "unique; the solution for contacts of equal, high radial stiffness is reported"
    ]
