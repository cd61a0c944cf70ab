"""What assembly changed: the values the user gave that had to move so that the loops close."""

from __future__ import annotations

import numpy as np

from engine.simulation.block import Block
from engine.system.build import Built
from engine.system.structure import state_coordinates

NOTICE = 1e-9
"""Changes below this (rad; lengths per length scale) are round-off of the numbers as written."""


def moved_notes(built: Built, block: Block) -> list[str]:
    """Lines for the user: one for every given start value that assembly moved, and one for every start value that is not used."""
    system, n = built.system, built.numbers
    notes = list(n.ignored)
    q, v = block.y[: system.nq], block.y[system.nq : system.nq + system.nv]
    for j in system.tree:
        states = state_coordinates(j)
        was, now = n.q[j.q0 : j.q0 + len(states)], q[j.q0 : j.q0 + len(states)]
        given = n.q_given[j.q0 : j.q0 + len(states)] != 0.0
        if given.any() and np.abs(was - now).max() > NOTICE * max(1.0, n.length):
            notes.append(f"{j.name}: start q moved from {_list(was)} to {_list(now)} so that the loops close")
        was, now = n.v[j.v0 : j.v0 + len(j.free)], v[j.v0 : j.v0 + len(j.free)]
        given = n.v_given[j.v0 : j.v0 + len(j.free)] != 0.0
        if given.any() and np.abs(was - now).max() > NOTICE * n.rate * max(1.0, n.length):
            notes.append(f"{j.name}: start qd moved from {_list(was)} to {_list(now)} so that the loops close")
    return notes


def _list(values: np.ndarray) -> str:
    text = ", ".join(f"{x:.9g}" for x in values)
    return text if len(values) == 1 else f"[{text}]"
