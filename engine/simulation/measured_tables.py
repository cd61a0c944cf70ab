"""Tables that others wrote: columns by name, of a CSV file with a line of names, or of what ``simulate -o`` wrote."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.simulation.tables import load_result_table


def columns_of(file: str, where: str) -> tuple[list[str], np.ndarray]:
    """(names, numbers: rows × names) of a table. where: the option it was named with. SceneError when it cannot be read."""
    path = Path(file)
    try:
        read = load_result_table(path)
        return ["time", *read.names], np.column_stack([read.time, *(read[n] for n in read.names)])
    except SceneError as told:
        if path.suffix.lower() != ".csv":
            raise
        try:
            with path.open(encoding="utf-8") as lines:
                names = [n.strip() for n in next(x for x in lines if x.strip() and not x.startswith("#")).split(",")]
            return names, np.atleast_2d(np.loadtxt(path, delimiter=",", skiprows=_head(path), comments="#"))
        except (OSError, ValueError, StopIteration) as e:
            raise SceneError([Problem(where, f"cannot read {file!r}: {e}", "a CSV file: names first, then numbers")]) from told


def _head(path: Path) -> int:
    """Lines up to and with that of the names."""
    with path.open(encoding="utf-8") as lines:
        return 1 + next(i for i, x in enumerate(lines) if x.strip() and not x.startswith("#"))
