"""Many values of a group of numbers, put into their entries without building a scene for each: where the table of parameters knows
the entries, where the number is copied, or where a formula says what becomes of it (``derived``)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from engine.basics.problems import SceneError
from engine.batch.derived import entries_of, total_mass
from engine.scene.overrides import apply
from engine.system.build import Built

MOST_CORNERS = 64
"""Corners of the box of a group's values at which the scene is checked; above, every value is built."""
TRIED = 5
"""Values that are built to see what a number acts on: the ends and in between."""
Placed = tuple[np.ndarray, np.ndarray]
"""(entries of the flat numbers; numbers there for each of the values)."""
Known = tuple[np.ndarray, Callable[[np.ndarray], np.ndarray]]
"""(entries of the flat numbers; what values become there)."""
Flat = Callable[[np.ndarray], np.ndarray | None]


def _themselves(values: np.ndarray) -> np.ndarray:
    return values


class Placing:
    """A group of paths of one owner. start: the scene that is changed; base: its flat numbers; mass: where the mass of all bodies
    stands among these; flat: the flat numbers of the scene with some values of the group, None where it is refused or of another
    structure."""

    def __init__(self, start: Built, base: np.ndarray, mass: int, paths: tuple[str, ...], flat: Flat):
        self.start, self.base, self.mass, self.paths, self.flat = start, base, mass, paths, flat
        self.known: Known | None = None
        self.box = np.full((2, len(paths)), np.nan)
        """Between these values ``known`` has been tried."""

    def of(self, distinct: np.ndarray) -> Placed | None:
        """Where these values (n × paths) go; None where each has to be built. What was tried on values
        around them is not tried again."""
        low, high = distinct.min(axis=0), distinct.max(axis=0)
        if self.known is None or not ((self.box[0] <= low) & (high <= self.box[1])).all():
            around = np.array([np.fmin(low, self.box[0]), np.fmax(high, self.box[1])])
            ends = np.unique(np.vstack([around, distinct]), axis=0) if self.known else distinct
            self.known, self.box = self._table(ends) or self._copied(ends) or self._derived(ends), around
        return (self.known[0], self.known[1](distinct)) if self.known else None

    def _table(self, distinct: np.ndarray) -> Known | None:
        """The entries that the numbers are, where the table of parameters knows them all and the scene takes the values."""
        place = [self.start.parameters.place(p) for p in self.paths]
        return (np.array(place), _themselves) if None not in place and self._taken(distinct) else None

    def _copied(self, distinct: np.ndarray) -> Known | None:
        """The entries that are the path's number itself, for numbers the table does not place (start values, points). None when
        it acts in another way."""
        if len(self.paths) > 1 or (found := self._tried(distinct)) is None:
            return None
        tried, rows = found
        differs = np.flatnonzero((rows != self.base).any(axis=0))
        return (differs, _themselves) if len(differs) and (rows[:, differs] == tried).all() else None

    def _derived(self, distinct: np.ndarray) -> Known | None:
        """By a formula. None where there is none, or where it gives another bit than a scene built with some of the values."""
        formula = entries_of(self.start, self.paths)
        if formula is None or not self._taken(distinct) or (found := self._tried(distinct)) is None:
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

    def _taken(self, distinct: np.ndarray) -> bool:
        """Whether the scene takes the values at the corners of their box. Bounds and comparisons of numbers are linear, so they
        hold for all values when they hold there."""
        if 2 ** len(self.paths) > MOST_CORNERS:
            return False
        try:
            for corner in product(*zip(distinct.min(axis=0), distinct.max(axis=0), strict=True)):
                apply(self.start.scene, dict(zip(self.paths, map(float, corner), strict=True)))
        except SceneError:
            return False
        return True

    def _tried(self, distinct: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """(some of the values; the flat numbers of scenes built with them). None where one is refused or of another structure."""
        tried = distinct[np.unique(np.linspace(0, len(distinct) - 1, TRIED).astype(int))]
        tried = tried[(tried != 0.0).all(axis=1)]
        rows = [self.flat(v) for v in tried]
        return (tried, np.array(rows)) if len(rows) and not any(r is None for r in rows) else None
