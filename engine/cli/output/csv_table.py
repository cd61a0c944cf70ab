"""Tables of results over time as CSV files."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from trunnion.basics.atomic_files import writing


def write_csv(path: Path, names: Sequence[str], time: Iterable[float], rows: Iterable[Iterable[float]]) -> None:
    """Write a column ``time``, s, and the columns ``names``."""
    with writing(path, (".csv",)) as work, work.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["time", *names])
        for t, row in zip(time, rows, strict=True):
            out.writerow([repr(float(x)) for x in (t, *row)])
