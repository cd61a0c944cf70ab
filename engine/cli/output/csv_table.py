"""Tables of results over time as CSV files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from trunnion.basics.atomic_files import writing
from trunnion.simulation.results.csv_and_parquet import blocks_of, lines_of


def write_csv(path: Path, names: Sequence[str], time: np.ndarray, rows: np.ndarray) -> None:
    """Write a column ``time`` (n), s, and the columns ``names`` (c) with the values ``rows`` (n × c)."""
    with writing(path, (".csv",)) as work, work.open("wb") as file:
        file.write(",".join(["time", *names]).encode() + b"\n")
        for block in blocks_of(np.column_stack([time, rows])):
            file.write(lines_of(block))
