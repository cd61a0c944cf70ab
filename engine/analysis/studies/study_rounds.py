"""Studies: cases in rounds, where each round is chosen from the results of earlier rounds.

A study is a generator that yields cases and receives their results. The cases of a study depend only on its seed and on these
results. A restarted study therefore requests the same cases again, bit for bit.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.batch.cases.grids_and_samples import Cases

if TYPE_CHECKING:
    import pyarrow

REVISION = 2
"""Revision of the searches. The cases of a study follow from the rules of its revision, so a stored study keeps its revision."""
MISSING = "lost"
"""Outcome of a case that could not be run and has no row in the table."""


@dataclass(frozen=True)
class CaseResults:
    """Results of n cases. outcomes (n): outcome of each case; numbers: {result name: values (n)}, NaN for a missing value."""

    outcomes: tuple[str, ...]
    numbers: dict[str, np.ndarray]

    def __len__(self) -> int:
        return len(self.outcomes)

    @property
    def done(self) -> np.ndarray:
        """Whether each of the n cases ran to its end."""
        return np.array([o == "done" for o in self.outcomes], bool)


Rounds = Generator[np.ndarray, CaseResults, dict[str, Any]]
"""The generator yields cases (n × paths, SI units), receives their results, and returns the answer."""


@dataclass(frozen=True)
class Study(ABC):
    """The request of a study.

    Attributes:
        kind: name of the study.
        paths: paths of the varied numbers.
        units: units of the varied numbers.
        low: lower bounds of the varied numbers, SI units.
        high: upper bounds, SI units.
        most: largest number of cases.
        tolerance: width, relative to the ranges, at which the search ends.
        revision: revision of the search; a stored study can have an earlier revision than REVISION.
    """

    kind: ClassVar[str]
    paths: tuple[str, ...]
    units: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    most: int = field(kw_only=True)
    tolerance: float = field(default=1e-3, kw_only=True)
    revision: int = field(default=REVISION, kw_only=True)

    @property
    @abstractmethod
    def results(self) -> tuple[str, ...]:
        """The reductions that the study needs."""

    @abstractmethod
    def rounds(self, report: Callable[[dict[str, Any]], None]) -> Rounds:
        """The cases in rounds. After each round the study calls ``report`` with the intermediate answer."""

    def numbers(self, unit: np.ndarray) -> np.ndarray:
        """The varied numbers, SI units, at places in the unit box (… × paths)."""
        low, high = np.array(self.low), np.array(self.high)
        return low + (high - low) * unit


class StudyProgress:
    """The progress of a study.

    Attributes:
        values: parameter values of the cases requested so far (n × paths), SI units.
        finished: number of cases whose results are known.
        answer: the final or intermediate answer.
        is_over: whether the study has ended.
    """

    def __init__(self, study: Study):
        self.study = study
        self.answer: dict[str, Any] = {}
        self.is_over, self.finished = False, 0
        self.asking = study.rounds(self._note)
        self.values = np.array(next(self.asking), float)

    def _note(self, answer: dict[str, Any]) -> None:
        self.answer = answer

    @property
    def requested(self) -> int:
        """Number of cases requested so far."""
        return len(self.values)

    def report(self, seen: CaseResults) -> None:
        """Receive the results of the cases from ``finished`` to ``requested`` − 1."""
        self.finished = self.requested
        try:
            self.values = np.concatenate([self.values, self.asking.send(seen)])
        except StopIteration as end:
            self.answer, self.is_over = end.value, True

    def rows(self, start: int, stop: int) -> np.ndarray:
        """The parameter values of the cases from start to stop − 1 (cases × paths), SI units."""
        return self.values[start:stop]


class ReportedCases:
    """The parameter values of cases that a study in another process chooses and reports."""

    def __init__(self) -> None:
        self.start, self.values = 0, np.zeros((0, 0))

    def report(self, start: int, values: Sequence[Sequence[float]]) -> None:
        """Receive the parameter values of the cases from ``start`` on."""
        self.start, self.values = start, np.array(values, float)

    def __call__(self, start: int, stop: int) -> np.ndarray:
        """The parameter values of the cases from start to stop − 1. Raises RuntimeError for cases that were not reported."""
        found = self.values[max(0, start - self.start) : stop - self.start]
        if start < self.start or len(found) < stop - start:
            raise RuntimeError(f"the parameter values of the cases {start} to {stop - 1} are unknown here")
        return found


def study_cases(study: Study, values: Callable[[int, int], np.ndarray]) -> Cases:
    """All cases that a study may request. values(start, stop) returns their parameter values."""
    return Cases(study.paths, study.units, study.most, values)


def results_of(table: pyarrow.Table, start: int, stop: int, names: Sequence[str]) -> CaseResults:
    """The results of the cases from start to stop − 1. The table may lack some of these cases, and may contain further cases."""
    outcomes = [MISSING] * (stop - start)
    numbers = {n: np.full(stop - start, np.nan) for n in names}
    cases = table["case"].to_numpy()
    here = np.flatnonzero((cases >= start) & (cases < stop))
    ends = table["outcome"].to_pylist()
    for i in here:
        outcomes[cases[i] - start] = ends[i]
    for n in names:
        numbers[n][cases[here] - start] = table[n].to_numpy().astype(float)[here]
    return CaseResults(tuple(outcomes), numbers)
