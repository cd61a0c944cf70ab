"""Loops that share bodies, and the entries of S of (90): rows of two cut joints couple only where their paths to the ground share a
body. Ordered by least degree, the factor has few entries (theory, "Loops by
structure")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from trunnion.system.structure.bodies_and_joints import GROUND, Joint, System

MANY_ROWS = 16
"""Rows from which on structure is looked at: a dense factor of fewer takes less than a microsecond."""
FEW_ENTRIES = 0.5
"""Of those of a dense factor: more are not worth their lists."""


@dataclass(frozen=True)
class Fill:
    """Entries of the factor of S. order: rows of λ as they are eliminated; start: where the entries below each pivot begin in
    ``below``, which tells their places in that order, ascending."""

    order: tuple[int, ...] = ()
    start: tuple[int, ...] = ()
    below: tuple[int, ...] = ()


def path(system: System, c: Joint) -> tuple[int, ...]:
    """Bodies between those that a cut joint joins and the ground, the innermost first."""
    found: set[int] = set()
    for i in c.ends:
        while i != GROUND and i not in found:
            found.add(i)
            i = system.bodies[i].parent
    return tuple(sorted(found))


def rows_by_loop(system: System, active: Sequence[int]) -> list[tuple[Joint, list[int]]]:
    """The cut joints that have active rows, with their places among these."""
    place = {row: at for at, row in enumerate(active)}
    found = [(c, [place[r] for r in range(c.rows, c.rows + c.kind.rows) if r in place]) for c in system.cuts]
    return [(c, rows) for c, rows in found if rows]


def coupled(system: System, loops: Sequence[Joint]) -> list[set[int]]:
    """For each loop, the other loops that share a movable body with it."""
    through: dict[int, list[int]] = {}
    for at, c in enumerate(loops):
        for i in path(system, c):
            if system.tree[i].free:
                through.setdefault(i, []).append(at)
    out: list[set[int]] = [set() for _ in loops]
    for sharing in through.values():
        for at in sharing:
            out[at].update(sharing)
    return [others - {at} for at, others in enumerate(out)]


def fill(system: System, active: Sequence[int], part: float = FEW_ENTRIES) -> Fill:
    """Entries of the factor of S over the active rows; none where they are more than this part of a dense one's, as good then."""
    if len(active) < MANY_ROWS:
        return Fill()
    loops = rows_by_loop(system, active)
    near, most = coupled(system, [c for c, _ in loops]), part * len(active) * (len(active) + 1) / 2
    sequence, after, entries, left = [], [], 0, set(range(len(loops)))
    while left:
        at = min(left, key=lambda k: (len(near[k]), k))
        left.remove(at)
        others = near[at]
        for k in others:
            near[k] |= others
            near[k] -= {k, at}
        own, beyond = len(loops[at][1]), sum(len(loops[k][1]) for k in others)
        entries += own * (own + 1) // 2 + own * beyond
        if entries > most:
            return Fill()
        sequence.append(at)
        after.append(others)
    return _listed([rows for _, rows in loops], sequence, after)


def tables_of(f: Fill) -> dict[str, list[int]]:
    """As a kernel's tables have them."""
    return {"fill_order": list(f.order), "fill_start": list(f.start), "fill_below": list(f.below)}


def _listed(rows: list[list[int]], sequence: list[int], after: list[set[int]]) -> Fill:
    """The entries of loops that are eliminated in this sequence, each with those that come after it."""
    order = [r for at in sequence for r in rows[at]]
    place = {r: p for p, r in enumerate(order)}
    start, below = [0], []
    for at, others in zip(sequence, after, strict=True):
        beyond = sorted(place[r] for k in others for r in rows[k])
        for own in rows[at]:
            below += [p for r in rows[at] if (p := place[r]) > place[own]] + beyond
            start.append(len(below))
    return Fill(tuple(order), tuple(start), tuple(below))
