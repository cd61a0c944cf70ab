"""Results of sweeps: tables, files, statistics, and repeated runs of single cases."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trunnion.basics.arrow_columns import count_by
from trunnion.basics.atomic_files import writing
from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.optional_packages import brought
from trunnion.batch.plan_and_runner import Plan
from trunnion.batch.sample_statistics.quantiles_and_probabilities import USUAL, Spread
from trunnion.batch.sample_statistics.result_queries import indices_of, spreads_of
from trunnion.batch.sample_statistics.sobol_indices import Indices
from trunnion.batch.tables.case_table import WHY
from trunnion.batch.tables.trajectories import save_dataset
from trunnion.batch.tables.xarray_dataset import dataset
from trunnion.scene.units.python_arguments import Names, names_given
from trunnion.simulation.results.result import Result

if TYPE_CHECKING:
    import pandas
    import pyarrow
    import xarray

SUFFIXES = (".csv", ".parquet")


@dataclass(frozen=True)
class Sweep:
    """The result of a sweep.

    Attributes:
        plan: the plan.
        table: an Arrow table with a row for each case; units in the fields' metadata.
        wall_time: duration, s.
        stepping_time: processor time of stepping, summed over cores, s.
        build_time: time of symbolic build and compilation, s.
        cancelled: whether Ctrl-C ended the sweep; the table then holds the finished cases.
        trajectories: stored rows with a column ``case``; None if no rows are stored.
    """

    plan: Plan
    table: pyarrow.Table
    wall_time: float
    stepping_time: float
    build_time: float
    cancelled: bool = False
    trajectories: pyarrow.Table | None = None

    def __len__(self) -> int:
        return int(self.table.num_rows)

    def __repr__(self) -> str:
        ended = ", ".join(f"{count} {name}" for name, count in self.counts.items() if count)
        return f"<Sweep of {self.plan.scene.name}: {len(self)} cases × {self.table.num_columns} columns, {ended}>"

    @property
    def counts(self) -> dict[str, int]:
        """Number of cases by outcome."""
        return count_by(self.table)

    @property
    def missing_error_reasons(self) -> dict[str, int]:
        """{reason (``simulation.results.error_statement.REASONS``): number of cases without stated errors}; {} without
        ``certify``."""
        counts = count_by(self.table, WHY) if WHY in self.table.column_names else {}
        return {why: n for why, n in counts.items() if why}

    def to_arrow(self) -> pyarrow.Table:
        """The Arrow table. The metadata of its fields hold units and descriptions."""
        return self.table

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas frame indexed by case. Units are in ``frame.attrs["units"]``."""
        brought("pandas", "pandas", "to_pandas()")
        frame = self.table.to_pandas().set_index("case")
        frame.attrs["units"] = {f.name: f.metadata[b"unit"].decode() for f in self.table.schema}
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """An xarray dataset. If the cases are a grid, every path is a dimension; otherwise the dimension is ``case``. Units are in
        ``attrs``."""
        about = {"scene": self.plan.scene.name}
        return dataset(self.table, self.plan.cases.paths, self.plan.cases.count, about)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the table atomically, as CSV or Parquet by the suffix. SceneError for another suffix or an unwritable folder."""
        return _saved(self.table, path)

    def save_trajectories(self, path: str | os.PathLike[str]) -> Path:
        """Write the stored rows, as CSV or Parquet by the suffix. If the path has no suffix, write a Parquet data set with a folder
        for each case (``case=0/part-0.parquet``, …). SceneError if no rows are stored."""
        if self.trajectories is None:
            raise SceneError([Problem("trajectories", "no rows are stored", "name their columns in trajectories")])
        return _saved(self.trajectories, path) if Path(path).suffix else save_dataset(self.trajectories, path)

    def indices(self, of: Names = ()) -> list[Indices]:
        """Sobol indices of results (default: all results) with intervals. A Sobol index is the share of the result's variance that
        a varied number causes. SceneError unless the sampling is "saltelli"."""
        return indices_of(self.plan.cases, self.plan.reductions, self.table, names_given(of))

    def spreads(
        self, of: Names = (), at: Sequence[float] = USUAL, above: Mapping[str, Sequence[Any]] | None = None
    ) -> list[Spread]:
        """Quantiles of results (default: all results) at probabilities, and probabilities of exceeding bounds ({result: bounds}),
        with intervals. SceneError if the cases are not a sample."""
        return spreads_of(self.plan.cases, self.plan.reductions, self.table, names_given(of), at, above)

    def trajectory(self, case: int, outputs: Sequence[str] | None = None, certify: bool = False) -> Result:
        """Run one case again, and return all its rows. certify: whether to estimate the global error of each number."""
        return trajectory(self.plan, case, outputs, certify=certify)


def _saved(table: pyarrow.Table, path: str | os.PathLike[str]) -> Path:
    """Write a table atomically, as CSV or Parquet by the suffix."""
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
    """Run one case of a plan by ``simulate``, with the kernel of the batch. changes: the varied numbers of the case, by default as
    in the plan. certify: whether to estimate errors."""
    from trunnion.simulation.run import simulate

    r = of.run
    changes = of.cases.changes(case) if changes is None else changes
    return simulate(
        of.scene, r.until, r.every, r.rtol, r.method, of.kernel, changes, outputs, max_steps=r.max_steps, certify=certify
    )  # fmt: skip
