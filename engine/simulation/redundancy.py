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
    the joints whose reactions are therefore not unique (the reactions reported there are the smallest in the bodies' own
    metric)."""

    count: int
    joints: tuple[str, ...] = ()


def redundancy(block: Block) -> Redundancy:
    """Redundancy at the block's present state."""
    if not block.kernel.sizes["rows"]:
        return Redundancy(0)
    open_directions = block.redundancy()
    size = np.linalg.norm(open_directions, axis=0) if open_directions.size else np.zeros(0)
    open_directions = open_directions[:, size > 0.5]
    names, at = [], 0
    for name, rows in block.kernel.facts["loop_rows"]:
        part = open_directions[at : at + rows]
        at += rows
        if part.size and np.abs(part).max() > SHARE:
            names.append(name)
    return Redundancy(open_directions.shape[1], tuple(names))


def redundancy_notes(r: Redundancy) -> list[str]:
    """The line a user is told when reactions are not unique; none when they all are."""
    if r.count == 0:
        return []
    times = "once" if r.count == 1 else f"{r.count} times"
    joints = ", ".join(r.joints)
    return [f"the loops are redundant {times}: the motion is unique, the reactions of {joints} are not (smallest reported)"]
