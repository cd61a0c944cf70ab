"""What became of the cases of a chunk, gathered from the loops that ran them, in whatever order those come."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from engine.basics.problems import SceneError
from engine.batch.loop import Reduced, invalid
from engine.batch.table import table
from engine.simulation.audit import Audit
from engine.simulation.certainty.stated import REASONS
from engine.simulation.outcome import Outcome

if TYPE_CHECKING:
    import pyarrow

STARTED_NOT = tuple(REASONS).index("start")


class Ended:
    """Of ``count`` cases; ``wrong``: those whose numbers the scene refuses. width: reductions kept of each. finished: which have
    ended."""

    def __init__(self, count: int, width: int, wrong: Mapping[int, SceneError]):
        self.outcomes: list[Outcome] = [invalid(())] * count
        self.audits = [Audit()] * count
        self.steps, self.numbers = np.zeros(count, np.int64), np.full((count, width), np.nan)
        self.why, self.finished = np.full(count, STARTED_NOT, np.int8), np.zeros(count, bool)
        for i, error in wrong.items():
            self.outcomes[i], self.finished[i] = invalid(error.problems), True

    def take(self, got: Reduced) -> None:
        """Those that a loop has run."""
        self.numbers[got.index], self.steps[got.index], self.finished[got.index] = got.numbers, got.steps, True
        self.why[got.index] = 0 if got.why is None else got.why
        for i, o, a in zip(got.index, got.outcomes, got.audits, strict=True):
            self.outcomes[i], self.audits[i] = o, a

    def table(self, shape: pyarrow.Schema, start: int, values: np.ndarray) -> pyarrow.Table:
        """The rows of the cases that have ended; start: the number of the first; values: their numbers (count × paths)."""
        at = np.flatnonzero(self.finished)
        ends = [self.outcomes[i] for i in at], [self.audits[i] for i in at]
        return table(shape, start + at, values[at], *ends, self.steps[at], self.numbers[at], self.why[at])
