"""The data of a result: columns with units, events, outcome, statistics, and the origin of the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.name_patterns import suggestion
from trunnion.kernel.interface.output_columns import Column, select
from trunnion.simulation.results.audit import Audit
from trunnion.simulation.results.error_statement import Certainty
from trunnion.simulation.results.event import Event
from trunnion.simulation.results.friction_uniqueness import Certificate
from trunnion.simulation.results.outcome import Outcome
from trunnion.simulation.results.redundant_reactions import Redundancy

if TYPE_CHECKING:
    from trunnion.scene.data_classes.scene import Scene


@dataclass(frozen=True)
class Stats:
    """The cost of a run.

    Attributes:
        wall_time: time of stepping, s.
        build_time: time of symbolic build and compilation, s; 0 for a cached kernel.
        setup_time: time of loading and assembly, s.
        steps: number of accepted steps.
        rejected: number of rejected steps.
        rhs_evaluations: number of evaluations of the right-hand side.
        jacobians: number of Jacobians.
        events: number of events.
        counters: all counters of the runtime by name.
    """

    wall_time: float
    build_time: float
    setup_time: float
    steps: int
    rejected: int
    rhs_evaluations: int
    jacobians: int
    events: int
    counters: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class ResultData:
    """The data of a run. ``data`` (rows × (1 + columns)) holds the times, s, then the columns in their units."""

    scene: Scene
    data: np.ndarray
    columns: tuple[Column, ...]
    events: tuple[Event, ...]
    outcome: Outcome
    stats: Stats
    settings: dict[str, Any]
    notes: tuple[str, ...] = ()
    redundancy: Redundancy = field(default_factory=lambda: Redundancy(0))
    certificate: Certificate = field(default_factory=Certificate)
    audit: Audit = field(default_factory=Audit)
    certainty: Certainty | None = None
    """The global error of every value, if the run was made with ``certify`` or ``accuracy``; else None."""

    @property
    def names(self) -> list[str]:
        """Column names, ``time`` first."""
        return ["time", *(c.name for c in self.columns)]

    @property
    def units(self) -> dict[str, str]:
        """Unit of every column."""
        return {"time": "s", **{c.name: c.unit for c in self.columns}}

    @property
    def time(self) -> np.ndarray:
        """Output times (rows), s."""
        return self.data[:, 0]

    def __getitem__(self, name: str) -> np.ndarray:
        """A column by name. Raises KeyError for an unknown name; the error suggests similar names."""
        try:
            return self.data[:, self._index[name]]
        except KeyError:
            hint = suggestion(name, self.names, most=3)
            raise KeyError(f"no column {name!r}{'; ' * bool(hint)}{hint}") from None

    def __contains__(self, name: str) -> bool:
        return name in self._index

    def __len__(self) -> int:
        return len(self.data)

    @property
    def _index(self) -> dict[str, int]:
        if "_cached_index" not in self.__dict__:
            object.__setattr__(self, "_cached_index", {n: i for i, n in enumerate(self.names)})
        return self.__dict__["_cached_index"]

    def matching(self, pattern: str) -> list[str]:
        """Names of columns that match a shell-style pattern."""
        return [c.name for c in select(list(self.columns), (pattern,))]

    def keeping(self, patterns: Sequence[str]) -> Self:
        """The result with only the columns that match one of the patterns."""
        chosen = {c.name for c in select(list(self.columns), tuple(patterns))}
        if len(chosen) == len(self.columns):
            return self
        places = [i for i, c in enumerate(self.columns) if c.name in chosen]
        columns, data = tuple(self.columns[i] for i in places), self.data[:, [0, *(i + 1 for i in places)]]
        return replace(self, data=data, columns=columns, certainty=self.certainty and self.certainty.only(places))

    def __repr__(self) -> str:
        return f"<Result of {self.scene.name}: {len(self)} rows × {len(self.names)} columns, {self.outcome}>"
