"""Limits on the number of rows and the number of events of a run, from memory and time."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from trunnion.basics.errors import Problem
from trunnion.simulation.results.outcome import TOO_MANY_EVENTS, TOO_MANY_ROWS

NUMBER = 8
"""Bytes of a number."""
COPIES = 2
"""Number of copies of the rows in memory while they are concatenated."""
SHARE = 0.5
"""Share of the memory that the rows, or the events, of a result may take. Pictures, files and other programs need the rest."""
ASSUMED = 8 * 1024**3
"""Assumed memory, bytes, if the system does not report its memory."""
MOST_ROWS = 1e9
"""Largest number of rows of a run, even if the rows are only reduced and not stored. So many rows take about 15 minutes."""
NEVER_MANY = 100_000
"""Requests for at most this many rows are accepted with any number of columns."""
EVENT_BYTES = 2000
"""Memory of an event, bytes: two copies of the runtime's record, and the Event object."""
CONTROL_GROUP = Path("/sys/fs/cgroup/memory.max")


@lru_cache(maxsize=1)
def memory() -> int:
    """Memory available to this process, bytes: the memory of the machine, or the limit of its container."""
    found = [ASSUMED]
    with suppress(AttributeError, ValueError, OSError):
        found = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    with suppress(OSError, ValueError):
        found.append(int(CONTROL_GROUP.read_text()))
    return min(found)


def expected_rows(until: float, every: float, step: float = 0.0) -> float:
    """Number of output rows of a run; 0 if error control determines this number. until, every, step: s."""
    spacing = every if every > 0.0 else step
    return until / spacing + 1.0 if spacing > 0.0 else 0.0


def most_rows(columns: int) -> float:
    """Largest number of rows of a run. columns: number of values stored for each row; 0 if rows are not stored."""
    return min(MOST_ROWS, SHARE * memory() / (COPIES * NUMBER * columns)) if columns else MOST_ROWS


def most_events() -> float:
    """Largest number of events of a run."""
    return SHARE * memory() / EVENT_BYTES


class Room:
    """The numbers of rows and events that a run can still store. columns: number of values in a row. free: whether the number of
    rows is unknown before the run."""

    def __init__(self, columns: int, free: bool) -> None:
        self.rows = most_rows(columns) - 1.0 if free else math.inf
        self.events = most_events()

    def take(self, rows: int, events: int) -> str | None:
        """Count new rows and events. Returns the outcome if a limit is exceeded, else None."""
        self.rows -= rows
        self.events -= events
        return TOO_MANY_ROWS if self.rows < 0.0 else TOO_MANY_EVENTS if self.events < 0.0 else None


def row_problems(until: float, every: float, step: float = 0.0, columns: int = 0) -> list[Problem]:
    """A problem if a run has too many rows. until, every, step: s. columns: number of values stored for each row; 0 if rows are not
    stored."""
    rows = expected_rows(until, every, step)
    need, most = COPIES * NUMBER * columns * rows, most_rows(columns)
    if rows <= most:
        return []
    spacing = rounded_up(until / max(most - 1.0, 1.0))
    what = f"{until:g} s with a row every {every or step:g} s make {rows:.3g} rows"
    if columns:
        what += f" of {columns} numbers, which need {size(need)}; this machine has {size(memory())}"
    else:
        what += f"; a run may have at most {most:.0e}"
    hint = f"set every to {spacing:g} s or more, end earlier" + (", or choose fewer outputs" if columns > 2 else "")
    return [Problem("every" if every > 0.0 else "step", what, hint)]


def rounded_up(value: float) -> float:
    """The smallest number with one significant digit that is not below ``value``."""
    unit = 10.0 ** math.floor(math.log10(value))
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.1g}")


def size(count: float) -> str:
    """A number of bytes as text with a unit."""
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if count < 1000.0 or unit == "TB":
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return ""
