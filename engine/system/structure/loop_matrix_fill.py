"""Sparsity of S in (90) and of its factor (theory, "Loops by structure"). The rows of two cut joints are coupled only if the paths
of the joints to the ground share a body. The minimum-degree order keeps the factor sparse."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.system.structure.bodies_and_joints import Joint, System, way_to_ground

MANY_ROWS = 16
"""Smallest number of rows for which sparsity is used. With fewer rows, a dense factorisation takes less than a microsecond."""
FEW_ENTRIES = 0.5
"""Sparsity is used if the sparse factor has at most this fraction of a dense factor's entries. With more entries, index lists cost
more time than sparsity saves."""


@dataclass(frozen=True)
class Fill:
    """Sparsity pattern of the factor of S. Empty: dense.

    order   indices of λ in the order of elimination.
    start   for each pivot, index of its first entry in ``below``.
    below   positions in ``order`` of the nonzero entries below each pivot, ascending."""

    order: tuple[int, ...] = ()
    start: tuple[int, ...] = ()
    below: tuple[int, ...] = ()

    def entries(self, at: Callable[[int, int], int]) -> list[int]:
        """For each entry of ``below``, its index in S, from its row and its pivot's column. at: function that gives the index of a
        row and a column."""
        pivots = [j for j in range(len(self.order)) for _ in range(self.start[j], self.start[j + 1])]
        return [at(self.order[i], self.order[j]) for i, j in zip(self.below, pivots, strict=True)]

    def by_row(self) -> tuple[list[int], list[int], list[int]]:
        """The entries row by row: start of each row, pivots of its entries, and their indices in ``below``."""
        rows: list[list[tuple[int, int]]] = [[] for _ in self.order]
        for j in range(len(self.order)):
            for p in range(self.start[j], self.start[j + 1]):
                rows[self.below[p]].append((j, p))
        every = [entry for row in rows for entry in row]
        return list(accumulate(map(len, rows), initial=0)), [j for j, _ in every], [p for _, p in every]


def path(system: System, c: Joint) -> tuple[int, ...]:
    """Bodies on the paths from the bodies of a cut joint to the ground, inboard bodies first."""
    return tuple(sorted({body for end in c.ends for body in way_to_ground(system.bodies, end)}))


def rows_by_loop(system: System, active: Sequence[int]) -> list[tuple[Joint, list[int]]]:
    """The cut joints that have active rows, each with the positions of these rows among all active rows."""
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


def fill(system: System, active: Sequence[int]) -> Fill:
    """Sparsity pattern of the factor of S for the active rows. The pattern is empty, which means a dense factor, in three cases:
    few rows; a contact that may open; more than the fraction ``FEW_ENTRIES`` of a dense factor's entries."""
    return Fill() if len(active) < MANY_ROWS or system.light or system.unilateral else pattern(system, active, FEW_ENTRIES)


def pattern(system: System, active: Sequence[int], part: float = 1.0) -> Fill:
    """Like ``fill``, for any number of rows. The result is empty only if the factor has more than the fraction ``part`` of a dense
    factor's entries."""
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


def tables_of(f: Fill, at: Callable[[int, int], int]) -> dict[str, list[int]]:
    """The pattern as lists, by name of the kernel's table. at: index of an entry in the maps' S; −1: a structural zero."""
    row, pivot, entry = f.by_row() if f.below else ([], [], [])
    places = [*(at(r, r) for r in f.order), *f.entries(at)]
    return {"fill_order": list(f.order), "fill_start": list(f.start), "fill_below": list(f.below), "fill_at": places,
            "fill_row": row, "fill_pivot": pivot, "fill_entry": entry}  # fmt: skip


def _listed(rows: list[list[int]], sequence: list[int], after: list[set[int]]) -> Fill:
    """The pattern for loops that are eliminated in ``sequence``. after: for each loop, the coupled loops eliminated later."""
    order = [r for at in sequence for r in rows[at]]
    place = {r: p for p, r in enumerate(order)}
    start, below = [0], []
    for at, others in zip(sequence, after, strict=True):
        beyond = sorted(place[r] for k in others for r in rows[k])
        for own in rows[at]:
            below += [p for r in rows[at] if (p := place[r]) > place[own]] + beyond
            start.append(len(below))
    return Fill(tuple(order), tuple(start), tuple(below))
