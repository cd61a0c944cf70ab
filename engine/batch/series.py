"""Rows of many cases kept while they run: columns against time, one table with a column ``case``; and as a data set of files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.basics import arrow
from engine.basics.problems import Problem
from engine.kernel.columns import Column, select
from engine.simulation.run import pattern_problems

if TYPE_CHECKING:
    import pyarrow

ON_A_ROW = 1e-6
"""Of a spacing: a row so near to a multiple of it is one of its rows."""
FORMAT = "trunnion rows 1"


@dataclass(frozen=True)
class Series:
    """What is kept of the rows of every case. columns: which; every: spacing of the rows kept, s; None: all rows."""

    columns: tuple[Column, ...]
    every: float | None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(c.name for c in self.columns)

    @property
    def schema(self) -> pyarrow.Schema:
        """The schema of its table: ``case``, ``time`` and the columns, with units."""
        import pyarrow as pa

        def field(name: str, kind: Any, unit: str, text: str) -> Any:
            return pa.field(name, kind, nullable=False, metadata={"unit": unit, "description": text})

        fields = [field("case", pa.int64(), "1", "number of the case, from 0"), field("time", pa.float64(), "s", "time")]
        fields += [field(c.name, pa.float64(), c.unit, c.description) for c in self.columns]
        return pa.schema(fields, metadata={"format": FORMAT})

    def thinned(self, rows: np.ndarray) -> np.ndarray:
        """Of rows (case, time, …) those at multiples of the spacing."""
        if self.every is None:
            return rows
        parts = rows[:, 1] / self.every
        return rows[np.abs(parts - np.round(parts)) < ON_A_ROW]

    def table(self, cases: np.ndarray, rows: np.ndarray) -> pyarrow.Table:
        """The table of rows (n × (1 + columns): time, then the columns) of these cases (n), in order of cases."""
        import pyarrow as pa

        order = np.argsort(cases, kind="stable")
        arrays = [arrow.numbers(cases[order].astype(np.int64)), *(arrow.numbers(c) for c in rows[order].T)]
        return pa.Table.from_arrays(arrays, schema=self.schema)


def series_of(everything: Sequence[Column], patterns: Sequence[str], every: float | None, problems: list[Problem]) -> Series | None:
    """What patterns of columns ask for; None for no patterns. Mistakes go on the list."""
    if every is not None and not (isfinite(every) and every > 0.0):
        problems.append(Problem("spacing", f"{every:g} s is no spacing", "a positive time, or none for all rows"))
    if every is not None and not patterns:
        problems.append(Problem("spacing", "no rows are kept", "name their columns: trajectories"))
    if not patterns:
        return None
    found = pattern_problems(list(everything), tuple(patterns))
    problems += [Problem("trajectories", p.what, p.hint) for p in found]
    return Series(tuple(select(list(everything), tuple(patterns))), every)


def save_dataset(table: pyarrow.Table, folder: str | os.PathLike[str]) -> Path:
    """Write rows of cases as a Parquet data set: ``case=0/part-0.parquet``, …, as ``pyarrow.dataset.dataset(folder,
    partitioning="hive")`` and others read it."""
    import pyarrow as pa
    import pyarrow.dataset as ds

    by = ds.partitioning(pa.schema([("case", pa.int64())]), flavor="hive")
    most = max(1, len(table["case"].unique()))
    ds.write_dataset(
        table, folder, format="parquet", partitioning=by, max_partitions=most, existing_data_behavior="delete_matching"
    )
    return Path(folder)
