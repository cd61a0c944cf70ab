"""What the rows of a run would take, in memory and time, computed before the run: too much is refused with numbers, wherever a
run is asked for."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from engine.basics.problems import Problem
from engine.simulation.outcome import TOO_MANY_EVENTS, TOO_MANY_ROWS

NUMBER = 8
"""Bytes of a number of a row."""
COPIES = 2
"""Rows are collected in pieces and then put together, so that they are there twice for a moment."""
SHARE = 0.5
"""Share of this machine's memory that a result's rows may take; the rest is for drawing, writing and everybody else."""
ASSUMED = 8 * 1024**3
"""Bytes of memory assumed for a machine that does not say how much it has."""
MOST_ROWS = 1e9
"""Rows one run may have, also where only their extremes are kept: at a microsecond each, they take a quarter of an hour."""
NEVER_MANY = 100_000
"""Rows below which no scene has enough columns to matter, so that nobody need count them."""
EVENT_BYTES = 2000
"""Bytes of an event: the runtime's record of it, there twice for a moment, and what is told of it."""
CONTROL_GROUP = Path("/sys/fs/cgroup/memory.max")


@lru_cache(maxsize=1)
def memory() -> int:
    """How many bytes this process may use: the machine's memory, or what a container allows."""
    found = [ASSUMED]
    with suppress(AttributeError, ValueError, OSError):
        found = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    with suppress(OSError, ValueError):
        found.append(int(CONTROL_GROUP.read_text()))
    return min(found)


def expected_rows(until: float, every: float, step: float = 0.0) -> float:
    """Number of output rows of a run; 0 where only the error control decides it."""
    spacing = every if every > 0.0 else step
    return until / spacing + 1.0 if spacing > 0.0 else 0.0


def most_rows(columns: int) -> float:
    """Number of rows one run may have. columns: how many numbers are kept of each; 0 where none is kept."""
    return min(MOST_ROWS, SHARE * memory() / (COPIES * NUMBER * columns)) if columns else MOST_ROWS


def most_events() -> float:
    """Number of events one run may have."""
    return SHARE * memory() / EVENT_BYTES


class Room:
    """What a run may still keep. columns: numbers of a row; free: nobody knew before how many rows there would be."""

    def __init__(self, columns: int, free: bool) -> None:
        self.rows = most_rows(columns) - 1.0 if free else math.inf
        self.events = most_events()

    def take(self, rows: int, events: int) -> str | None:
        """Keep so many more; the outcome of the run, where that is more than there is room for."""
        self.rows -= rows
        self.events -= events
        return TOO_MANY_ROWS if self.rows < 0.0 else TOO_MANY_EVENTS if self.events < 0.0 else None


def row_problems(until: float, every: float, step: float = 0.0, columns: int = 0) -> list[Problem]:
    """The problems of asking for so many rows; none when they can be had. columns: how many are kept of each row; 0 where none
    is kept, so that only time limits the rows."""
    rows = expected_rows(until, every, step)
    need, most = COPIES * NUMBER * columns * rows, most_rows(columns)
    if rows <= most:
        return []
    spacing = rounded_up(until / max(most - 1.0, 1.0))
    what = f"{until:g} s at {every or step:g} s are {rows:.3g} rows"
    if columns:
        what += f" of {columns} numbers, {size(need)} with what putting them together takes; this machine has {size(memory())}"
    else:
        what += f"; a run may have {most:.0e}"
    hint = f"set every to {spacing:g} s or more, end earlier" + (", or ask for fewer columns with outputs" if columns > 2 else "")
    return [Problem("every" if every > 0.0 else "step", what, hint)]


def rounded_up(value: float) -> float:
    """The next larger number with one significant digit."""
    unit = 10.0 ** math.floor(math.log10(value))
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.1g}")


def size(count: float) -> str:
    """A number of bytes as readable text."""
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if count < 1000.0 or unit == "TB":
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return ""
