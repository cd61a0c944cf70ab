"""Stored rows of many cases: one table of columns over time with a column ``case``, or a data set of files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from trunnion.basics import arrow_columns
from trunnion.basics.arrow_columns import field
from trunnion.basics.errors import Problem
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.interface.output_columns import Column, select
from trunnion.simulation.run import pattern_problems

if TYPE_CHECKING:
    import pyarrow

ON_A_ROW = 1e-6
"""A row's time counts as a multiple of the spacing if its distance from the multiple, relative to the spacing, is below this
value."""
FORMAT = "trunnion rows 1"


@dataclass(frozen=True)
class Series:
    """The rows to store for every case. columns: columns to store; every: spacing of the stored rows, s; None means all rows."""

    columns: tuple[Column, ...]
    every: float | None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(c.name for c in self.columns)

    @property
    def schema(self) -> pyarrow.Schema:
        """The schema of the table of stored rows: ``case``, ``time`` and the columns, with units."""
        import pyarrow as pa

        fields = [field("case", pa.int64(), "1", "number of the case, from 0"), field("time", pa.float64(), "s", "time")]
        fields += [field(c.name, pa.float64(), c.unit, c.description) for c in self.columns]
        return pa.schema(fields, metadata={"format": FORMAT})

    def thinned(self, rows: np.ndarray) -> np.ndarray:
        """The rows (case, time, …) whose times are multiples of the spacing."""
        if self.every is None:
            return rows
        parts = rows[:, 1] / self.every
        return rows[np.abs(parts - np.round(parts)) < ON_A_ROW]

    def table(self, cases: np.ndarray, rows: np.ndarray) -> pyarrow.Table:
        """The table of stored rows, in the order of cases. cases (n): case of each row; rows: n × (1 + columns), time first."""
        import pyarrow as pa

        order = np.argsort(cases, kind="stable")
        arrays = [arrow_columns.numbers(cases[order].astype(np.int64)), *(arrow_columns.numbers(c) for c in rows[order].T)]
        return pa.Table.from_arrays(arrays, schema=self.schema)


def series_of(everything: Sequence[Column], patterns: Sequence[str], every: float | None, problems: list[Problem]) -> Series | None:
    """The selection of rows to store, from patterns of columns. None without patterns. Mistakes are appended to ``problems``."""
    if every is not None and not (isfinite(every) and every > 0.0):
        problems.append(Problem("spacing", f"{every:g} s is not a positive time", "give a positive time, or omit it for all rows"))
    if every is not None and not patterns:
        problems.append(Problem("spacing", "no rows are stored", "name their columns in trajectories"))
    if not patterns:
        return None
    found = pattern_problems(list(everything), tuple(patterns))
    problems += [Problem("trajectories", p.what, p.hint) for p in found]
    return Series(tuple(select(list(everything), tuple(patterns))), every)


def save_dataset(table: pyarrow.Table, folder: str | os.PathLike[str]) -> Path:
    """Write rows of cases as a Parquet data set: ``case=0/part-0.parquet``, …; ``pyarrow.dataset.dataset(folder,
    partitioning="hive")`` reads it."""
    import pyarrow as pa
    import pyarrow.dataset as ds

    by = ds.partitioning(pa.schema([("case", pa.int64())]), flavor="hive")
    most = max(1, len(table["case"].unique()))
    ds.write_dataset(
        table, folder, format="parquet", partitioning=by, max_partitions=most, existing_data_behavior="delete_matching"
    )
    return Path(folder)
