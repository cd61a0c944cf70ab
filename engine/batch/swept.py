"""A sweep that was run: its table in the forms that people want, what it says, any case of it again."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.basics.extras import brought
from engine.basics.files import writing
from engine.basics.problems import Problem, SceneError
from engine.batch.answers import indices_of, spreads_of
from engine.batch.dims import dataset
from engine.batch.indices import Indices
from engine.batch.plan import Plan
from engine.batch.quantiles import USUAL, Spread
from engine.batch.series import save_dataset
from engine.batch.table import WHY
from engine.scene.given import Names, names_given
from engine.simulation.result import Result

if TYPE_CHECKING:
    import pandas
    import pyarrow
    import xarray

SUFFIXES = (".csv", ".parquet")


@dataclass(frozen=True)
class Sweep:
    """A sweep that was run, with a row for each case. counts: cases by outcome; wall_time, stepping_time (summed over cores) and
    build_time, s. stopped: whether it was interrupted; its rows are then those of the cases that were finished. trajectories: the
    rows that were kept, with a column ``case`` (``engine.batch.series.save_dataset`` writes them as files)."""

    plan: Plan
    table: pyarrow.Table
    wall_time: float
    stepping_time: float
    build_time: float
    counts: dict[str, int] = field(default_factory=dict)
    stopped: bool = False
    trajectories: pyarrow.Table | None = None

    def __len__(self) -> int:
        return int(self.table.num_rows)

    def __repr__(self) -> str:
        ended = ", ".join(f"{count} {name}" for name, count in self.counts.items() if count)
        return f"<Sweep of {self.plan.scene.name}: {len(self)} cases × {self.table.num_columns} columns, {ended}>"

    @property
    def unstated(self) -> dict[str, int]:
        """Of a sweep with errors: how many cases have none stated, by why (``REASONS`` of engine/simulation/certainty)."""
        import pyarrow.compute as pc

        if WHY not in self.table.column_names:
            return {}
        return {c["values"]: c["counts"] for c in pc.value_counts(self.table[WHY]).to_pylist() if c["values"]}

    def to_arrow(self) -> pyarrow.Table:
        """The table; units and descriptions in its fields' metadata."""
        return self.table

    def to_pandas(self) -> pandas.DataFrame:
        """A frame indexed by case; units in ``frame.attrs["units"]``."""
        brought("pandas", "pandas", "to_pandas()")
        frame = self.table.to_pandas().set_index("case")
        frame.attrs["units"] = {f.name: f.metadata[b"unit"].decode() for f in self.table.schema}
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """A dataset with a dimension for each path of the grid, or of the case alone where it is none; units in ``attrs``."""
        about = {"scene": self.plan.scene.name}
        return dataset(self.table, self.plan.cases.paths, self.plan.cases.count, about)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write CSV or Parquet, by suffix; whole or not at all. SceneError for another suffix or an unwritable folder."""
        return _saved(self.table, path)

    def save_trajectories(self, path: str | os.PathLike[str]) -> Path:
        """Write the rows that were kept: CSV or Parquet, by suffix, or without one a Parquet data set, a folder a case
        (``case=0/part-0.parquet``, …). SceneError where no rows were kept."""
        if self.trajectories is None:
            raise SceneError([Problem("trajectories", "no rows were kept", "name their columns: trajectories")])
        return _saved(self.trajectories, path) if Path(path).suffix else save_dataset(self.trajectories, path)

    def indices(self, of: Names = ()) -> list[Indices]:
        """Which varied numbers decide over results (default: all): Sobol indices with intervals, of a sample whose sampling is
        "saltelli"."""
        return indices_of(self.plan.cases, self.plan.reductions, self.table, names_given(of))

    def spreads(
        self, of: Names = (), at: Sequence[float] = USUAL, above: Mapping[str, Sequence[Any]] | None = None
    ) -> list[Spread]:
        """Quantiles of results at probabilities, and probabilities of being above bounds ({result: bounds}), each with an
        interval."""
        return spreads_of(self.plan.cases, self.plan.reductions, self.table, names_given(of), at, above)

    def trajectory(self, case: int, outputs: Sequence[str] | None = None, certify: bool = False) -> Result:
        """One case run again, keeping all its rows; certify: with the global error of each number."""
        return trajectory(self.plan, case, outputs, certify=certify)


def _saved(table: pyarrow.Table, path: str | os.PathLike[str]) -> Path:
    """Write a table as CSV or Parquet, by suffix; whole or not at all."""
    with writing(path, SUFFIXES) as work:
        if work.suffix.lower() == ".csv":
            from pyarrow import csv

            csv.write_csv(table, work)
        else:
            import pyarrow.parquet as pq

            pq.write_table(table, work, compression="zstd")
    return Path(path)


def trajectory(
    of: Plan, case: int, outputs: Sequence[str] | None = None, changes: Mapping[str, float] | None = None, certify: bool = False
) -> Result:
    """One case of a plan, run as ``engine.simulate`` runs it with the batch's kernel, keeping all its rows. changes: its numbers,
    where somebody else knows them; certify: whether errors are stated."""
    from engine.simulation.run import simulate

    r, most = of.run, int(of.run.steps or 0)
    changes = of.cases.changes(case) if changes is None else changes
    return simulate(
        of.scene, r.until, r.every, r.rtol, r.method, of.kernel, changes, outputs, max_steps=most, certify=certify
    )  # fmt: skip
