"""Studies: cases in rounds, each round following from what the ones before gave.

A study asks for cases and is told their results, by a generator; everything it decides follows from its seed and from those results
alone. So whoever has the results can go on from them: a study whose program was killed asks for the same cases again, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from engine.batch.cases import Cases

if TYPE_CHECKING:
    import pyarrow

LOST = "lost"
"""The outcome of a case of which there is no row: it could not be run at all."""


@dataclass(frozen=True)
class Seen:
    """Results of some cases. outcomes: how each ended; numbers: of each result a study asked for, NaN where there is none."""

    outcomes: tuple[str, ...]
    numbers: dict[str, np.ndarray]

    def __len__(self) -> int:
        return len(self.outcomes)

    @property
    def done(self) -> np.ndarray:
        """Which cases ran to their end."""
        return np.array([o == "done" for o in self.outcomes], bool)


Asking = Generator[np.ndarray, Seen, dict[str, Any]]
"""Yields cases (n × paths), is sent what they gave, returns the answer."""


class Study(Protocol):
    """A question. kind: what it is called; paths, units: what it varies; results: the reductions it needs; most: cases at most."""

    @property
    def kind(self) -> str: ...
    @property
    def paths(self) -> tuple[str, ...]: ...
    @property
    def units(self) -> tuple[str, ...]: ...
    @property
    def most(self) -> int: ...

    @property
    def results(self) -> tuple[str, ...]:
        """The reductions it needs."""
        ...

    def asks(self, told: Callable[[dict[str, Any]], None]) -> Asking:
        """Its cases in rounds; ``told`` is called with how far it has come, after each."""
        ...


class Follow:
    """A study as far as its results are known. values: the cases asked for so far (n × paths); known: of how many the results are;
    answer: the last word, or how far it has come; over: whether it will ask for no more."""

    def __init__(self, study: Study):
        self.study = study
        self.answer: dict[str, Any] = {}
        self.over, self.known = False, 0
        self.asking = study.asks(self._told)
        self.values = np.array(next(self.asking), float)

    def _told(self, answer: dict[str, Any]) -> None:
        self.answer = answer

    @property
    def asked(self) -> int:
        """How many cases were asked for so far."""
        return len(self.values)

    def tell(self, seen: Seen) -> None:
        """The results of the cases ``known`` … ``asked`` − 1."""
        self.known = self.asked
        try:
            self.values = np.concatenate([self.values, self.asking.send(seen)])
        except StopIteration as end:
            self.answer, self.over = end.value, True

    def rows(self, start: int, stop: int) -> np.ndarray:
        """The numbers of cases asked for."""
        return self.values[start:stop]


class Told:
    """Numbers of cases that somebody else follows, as they are told."""

    def __init__(self) -> None:
        self.start, self.values = 0, np.zeros((0, 0))

    def tell(self, start: int, values: Sequence[Sequence[float]]) -> None:
        """The cases from ``start`` on."""
        self.start, self.values = start, np.array(values, float)

    def __call__(self, start: int, stop: int) -> np.ndarray:
        """Their numbers; RuntimeError for cases that were not told."""
        found = self.values[max(0, start - self.start) : stop - self.start]
        if start < self.start or len(found) < stop - start:
            raise RuntimeError(f"the numbers of the cases {start} to {stop - 1} are not known here")
        return found


def cases_of(study: Study, values: Callable[[int, int], np.ndarray]) -> Cases:
    """The cases of a study, as many as it may ask for."""
    return Cases(study.paths, study.units, study.most, values)


def seen_of(table: pyarrow.Table, start: int, stop: int, names: Sequence[str]) -> Seen:
    """The results of the cases start … stop − 1, of a table that may lack some and may have others."""
    outcomes = [LOST] * (stop - start)
    numbers = {n: np.full(stop - start, np.nan) for n in names}
    cases = table["case"].to_numpy()
    here = np.flatnonzero((cases >= start) & (cases < stop))
    ends = table["outcome"].to_pylist()
    for i in here:
        outcomes[cases[i] - start] = ends[i]
    for n in names:
        numbers[n][cases[here] - start] = table[n].to_numpy().astype(float)[here]
    return Seen(tuple(outcomes), numbers)
