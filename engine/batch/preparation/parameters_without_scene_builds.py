"""Writes the values of a group into entries of flat rows of numbers, without building a scene for each value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from trunnion.basics.errors import SceneError
from trunnion.batch.preparation.parameter_formulas import entries_of, total_mass
from trunnion.scene.overrides import apply
from trunnion.system.construction.system_builder import Built

MOST_CORNERS = 64
"""The scene is checked at the corners of the box that contains a group's values. If the box has more corners than this, the check
is not made, and a scene is built for every value."""
TRIED = 5
"""Number of values for which scenes are built to find the entries that depend on a number."""
Placed = tuple[np.ndarray, np.ndarray]
"""(indices of entries, the numbers in these entries for each value)."""
Known = tuple[np.ndarray, Callable[[np.ndarray], np.ndarray]]
"""(indices of entries, function from values to the numbers of these entries)."""
Flat = Callable[[np.ndarray], np.ndarray | None]


def _identity(values: np.ndarray) -> np.ndarray:
    return values


class Placing:
    """The entries of a group of paths of one owner.

    start: the built base scene; base: its flat numbers; mass: index of the total mass in ``base``; flat: function from values of
    the group to the flat numbers of the scene with these values, or None for rejected values or another structure; ends: the least
    and the largest values of all cases (2 × paths), NaN where unknown.
    """

    def __init__(self, start: Built, base: np.ndarray, mass: int, paths: tuple[str, ...], flat: Flat, ends: np.ndarray):
        self.start, self.base, self.mass, self.paths, self.flat, self.ends = start, base, mass, paths, flat, ends
        self.known: Known | None = None
        self.ways: Sequence[Callable[[np.ndarray], Known | None]] = (self._table_entries, self._copies, self._formula)
        self.box = np.full((2, len(paths)), np.nan)
        """The range of values in which ``known`` has been tested."""
        self.accepted: set[tuple[float, ...]] = set()

    def of(self, distinct: np.ndarray) -> Placed | None:
        """(indices of entries, their numbers) for values (n × paths); None if a scene must be built for each value.

        Values within the range of earlier tests need no test.
        """
        low, high = distinct.min(axis=0), distinct.max(axis=0)
        if self.known is None or not ((self.box[0] <= low) & (high <= self.box[1])).all():
            met = np.array([np.fmin(low, self.box[0]), np.fmax(high, self.box[1])])
            if not self._learn(met, distinct[:0]):  # test whether the known way also holds at the new ends of the range
                every = np.array([np.fmin(met[0], self.ends[0]), np.fmax(met[1], self.ends[1])])
                if not self._learn(every, distinct):
                    self.ends = np.full_like(self.ends, np.nan)
                    self._learn(met, distinct)
        return (self.known[0], self.known[1](distinct)) if self.known else None

    def _learn(self, box: np.ndarray, values: np.ndarray) -> bool:
        """Whether a way of ``self.ways`` finds the entries for values (n × paths) and for the ends of a box (2 × paths). If
        ``values`` is empty, only the way that last found the entries is tried."""
        tried = np.unique(np.vstack([box, values]), axis=0)
        for way in self.ways if len(values) else self.ways[: self.known is not None]:
            if known := way(tried):
                self.known, self.box, self.ways = known, box, (way, *(w for w in self.ways if w is not way))
                return True
        self.known = None
        return False

    def _table_entries(self, distinct: np.ndarray) -> Known | None:
        """The entries in the table of parameters; None if the table lacks a path or if the scene rejects the values."""
        place = [self.start.parameters.place(p) for p in self.paths]
        return (np.array(place), _identity) if None not in place and self._is_accepted(distinct) else None

    def _copies(self, distinct: np.ndarray) -> Known | None:
        """The entries that are copies of the number at the path (start values, points); None if the number acts in another way."""
        if len(self.paths) > 1 or (found := self._tried(distinct)) is None:
            return None
        tried, rows = found
        differs = np.flatnonzero((rows != self.base).any(axis=0))
        return (differs, _identity) if len(differs) and (rows[:, differs] == tried).all() else None

    def _formula(self, distinct: np.ndarray) -> Known | None:
        """The entries that a formula gives; None if there is no formula, or if a bit differs from the built scenes."""
        formula = entries_of(self.start, self.paths)
        if formula is None or not self._is_accepted(distinct) or (found := self._tried(distinct)) is None:
            return None
        index = {p: k for k, p in enumerate(self.start.parameters.paths)}
        if not index.keys() >= set(formula.parameters):
            return None
        place = [index[p] for p in formula.parameters] + [len(index) + k for k in formula.states]
        place += [len(self.base) - 1] if formula.pull else []
        tried, rows = found
        expected = np.repeat(self.base[None, :], len(tried), axis=0)
        expected[:, place] = formula.numbers(tried)
        expected[:, self.mass] = total_mass(self.start, expected)
        return (np.array(place), formula.numbers) if (expected.view(np.uint64) == rows.view(np.uint64)).all() else None

    def _is_accepted(self, distinct: np.ndarray) -> bool:
        """Whether the scene accepts the values at the corners of their box. The scene then accepts all values in the box, because
        bounds and comparisons are linear."""
        if 2 ** len(self.paths) > MOST_CORNERS:
            return False
        try:
            for corner in product(*zip(distinct.min(axis=0).tolist(), distinct.max(axis=0).tolist(), strict=True)):
                if corner not in self.accepted:
                    apply(self.start.scene, dict(zip(self.paths, corner, strict=True)))
                    self.accepted.add(corner)
        except SceneError:
            return False
        return True

    def _tried(self, distinct: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """(some of the values, flat numbers of the scenes built with these values). None if a scene rejects its values or has
        another structure."""
        tried = distinct[np.unique(np.linspace(0, len(distinct) - 1, TRIED).astype(int))]
        tried = tried[(tried != 0.0).all(axis=1)]
        rows = [self.flat(v) for v in tried]
        return (tried, np.array(rows)) if len(rows) and not any(r is None for r in rows) else None
