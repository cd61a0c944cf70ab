"""Tables of numbers from outside: CSV files with a line of names, or result files that ``simulate -o`` wrote."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from trunnion.basics.errors import Problem, SceneError
from trunnion.simulation.results.csv_and_parquet import load_result_table


def read_user_table(file: str, where: str) -> tuple[list[str], np.ndarray]:
    """(names, values (rows × names)) of a table. where: the option that names the file. Raises SceneError for an unreadable
    file."""
    path = Path(file)
    try:
        read = load_result_table(path)
        return list(read.names), read.data
    except SceneError as refused:
        if path.suffix.lower() != ".csv":
            raise
        try:
            with path.open(encoding="utf-8") as lines:
                names = [n.strip() for n in next(x for x in lines if x.strip() and not x.startswith("#")).split(",")]
                return names, np.atleast_2d(np.loadtxt(lines, delimiter=",", comments="#"))
        except (OSError, ValueError, StopIteration) as e:
            raise SceneError([Problem(where, f"cannot read {file!r}: {e}", "give a CSV file: names, then numbers")]) from refused
