"""Collects the results of a chunk's cases from the loops that ran the cases."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from trunnion.basics.errors import SceneError
from trunnion.batch.execution.c_case_loop import Reduced, invalid
from trunnion.batch.tables.case_table import table
from trunnion.simulation.results.audit import Audit
from trunnion.simulation.results.error_statement import REASONS
from trunnion.simulation.results.outcome import Outcome

if TYPE_CHECKING:
    import pyarrow

NO_START = tuple(REASONS).index("start")


class ChunkResults:
    """Collects the results of ``count`` cases. width: number of reductions; wrong: {index: error} of rejected cases; finished
    (count): whether each case has ended."""

    def __init__(self, count: int, width: int, wrong: Mapping[int, SceneError]):
        self.outcomes: list[Outcome] = [invalid(())] * count
        self.audits = [Audit()] * count
        self.steps, self.numbers = np.zeros(count, np.int64), np.full((count, width), np.nan)
        self.why, self.finished = np.full(count, NO_START, np.int8), np.zeros(count, bool)
        for i, error in wrong.items():
            self.outcomes[i], self.finished[i] = invalid(error.problems), True

    def take(self, got: Reduced) -> None:
        """Store the results of a loop."""
        self.numbers[got.index], self.steps[got.index], self.finished[got.index] = got.numbers, got.steps, True
        self.why[got.index] = 0 if got.why is None else got.why
        for i, o, a in zip(got.index, got.outcomes, got.audits, strict=True):
            self.outcomes[i], self.audits[i] = o, a

    def table(self, shape: pyarrow.Schema, start: int, values: np.ndarray) -> pyarrow.Table:
        """The rows of the finished cases. start: number of the first case; values: varied numbers of all cases (count × paths)."""
        at = np.flatnonzero(self.finished)
        ends = [self.outcomes[i] for i in at], [self.audits[i] for i in at]
        return table(shape, start + at, values[at], *ends, self.steps[at], self.numbers[at], self.why[at])
