"""The result of a run: columns with units, events, outcome, statistics, and everything needed to say where they came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.kernel.columns import Column
from engine.simulation.audit import Audit
from engine.simulation.certainty.stated import Certainty
from engine.simulation.certificate import Certificate
from engine.simulation.event import Event
from engine.simulation.outcome import Outcome
from engine.simulation.redundancy import Redundancy

if TYPE_CHECKING:
    import pandas
    import pyarrow
    import xarray

    from engine.scene.model import Scene


@dataclass(frozen=True)
class Stats:
    """What the run cost. wall_time: stepping alone, s; build_time: symbolic build and compilation, s (0 when the kernel came
    from the cache); setup_time: loading and assembly, s."""

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
class Result:
    """The result of a run: a row for every output time. A column is found by its name, ``result["ball.contact[1].angle"]``, and
    the times are ``result.time``, s."""

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
    """The global error of every number, where it was asked for (``certify``)."""

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
        """A column by name; KeyError with the nearest names when there is none."""
        try:
            return self.data[:, self._index[name]]
        except KeyError:
            from difflib import get_close_matches

            near = get_close_matches(name, self.names, 3)
            hint = f"; did you mean {', '.join(near)}?" if near else ""
            raise KeyError(f"no column {name!r}{hint}") from None

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
        from engine.kernel.columns import select

        return [c.name for c in select(list(self.columns), (pattern,))]

    def keeping(self, patterns: Sequence[str]) -> Result:
        """The result with only the columns that match one of the patterns."""
        from engine.kernel.columns import select

        chosen = {c.name for c in select(list(self.columns), tuple(patterns))}
        if len(chosen) == len(self.columns):
            return self
        places = [i for i, c in enumerate(self.columns) if c.name in chosen]
        columns, data = tuple(self.columns[i] for i in places), self.data[:, [0, *(i + 1 for i in places)]]
        return replace(self, data=data, columns=columns, certainty=self.certainty and self.certainty.only(places))

    def to_arrow(self) -> pyarrow.Table:
        """An Arrow table with units and metadata in its schema."""
        from engine.simulation.tables import to_arrow

        return to_arrow(self)

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas frame indexed by time, units in ``frame.attrs["units"]``."""
        from engine.basics.extras import brought

        pd = brought("pandas", "pandas", "to_pandas()")
        from engine.simulation.certainty.tabled import with_errors

        whole = with_errors(self)
        frame = pd.DataFrame(whole.data[:, 1:], columns=whole.names[1:], index=pd.Index(self.time, name="time"))
        frame.attrs["units"] = whole.units
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """A dataset with the dimension ``time``; units in ``attrs`` of each column, the scene's name and the outcome in those of
        the whole."""
        from engine.basics.extras import brought
        from engine.simulation.certainty.tabled import with_errors

        xr, all_of = brought("xarray", "xarray", "to_xarray()"), with_errors(self)
        about = [{"units": c.unit, "long_name": c.description} for c in all_of.columns]
        data = {c.name: ("time", all_of.data[:, i + 1], about[i]) for i, c in enumerate(all_of.columns)}
        whole = {"scene": self.scene.name, "outcome": str(self.outcome)}
        return xr.Dataset(data, {"time": ("time", self.time, {"units": "s"})}, whole)

    def save(self, path: str | Path) -> Path:
        """Write CSV or Parquet (by suffix) with metadata: scene, settings, version, outcome, events."""
        from engine.simulation.tables import save

        return save(self, Path(path))

    def __repr__(self) -> str:
        return f"<Result of {self.scene.name}: {len(self)} rows × {len(self.names)} columns, {self.outcome}>"

    def _repr_html_(self) -> str:
        """What a notebook displays: outcome, events, and a picture of the main curves."""
        from engine.simulation.notebook import html

        return html(self)
