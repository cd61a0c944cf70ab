"""Notes about start values that assembly changed to close the loops."""

from __future__ import annotations

import numpy as np

from trunnion.simulation.runtime_interface.simulation_block import Block
from trunnion.system.construction.system_builder import Built
from trunnion.system.structure.bodies_and_joints import state_coordinates

NOTICE = 1e-9
"""Largest change of a start value (rad, or m relative to the length scale) that counts as round-off of the value in the file."""


def assembly_notes(built: Built, block: Block) -> list[str]:
    """A note for every given start value that assembly changed, and for every given start value that is not used."""
    system, n = built.system, built.numbers
    notes = list(n.ignored)
    q, v = block.y[: system.nq], block.y[system.nq : system.nq + system.nv]
    if q.tobytes() == n.q.tobytes() and v.tobytes() == n.v.tobytes():
        return notes
    for j in system.tree:
        places, rates = slice(j.q0, j.q0 + len(state_coordinates(j))), slice(j.v0, j.v0 + len(j.free))
        both = ("q", n.q, q, n.q_given, places, 1.0), ("qd", n.v, v, n.v_given, rates, n.rate)
        for key, start, found, given, own, scale in both:
            was, now = start[own], found[own]
            if given[own].any() and np.abs(was - now).max() > NOTICE * scale * max(1.0, n.length):
                notes.append(f"{j.name}: start {key} moved from {_list(was)} to {_list(now)} so that the loops close")
    return notes


def _list(values: np.ndarray) -> str:
    text = ", ".join(f"{x:.9g}" for x in values)
    return text if len(values) == 1 else f"[{text}]"
