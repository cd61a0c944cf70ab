"""Layout of x, the external values that a system's functions take. All Python code uses this description.

x = [t, ts | tables | stop flags | modes].
t: time, s. ts: a time inside the current step, s, which alone selects the branch of a signal.
Tables: value and three derivatives of each table; external inputs are the first tables.
Stop flags: 1 while the end stop is engaged.
Modes: state flag, frozen direction and given tilt of every friction pair (see ``elements.friction.friction_law``).

The records are ``tr_moment``, ``tr_signal`` and ``tr_mode`` of ``trunnion.runtime.abi``. A simulation block refuses a kernel whose
x has another size."""

from __future__ import annotations

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.abi import run_records

TIMES = run_records.MOMENT.numbers
"""Number of values before the tables: t and ts."""
NOW, INSIDE = run_records.MOMENT.at("t"), run_records.MOMENT.at("inside")
"""Indices of t and ts in x."""
TABLE = run_records.SIGNAL.numbers
"""Number of values of a table: value and three derivatives."""
MODE = run_records.MODE.numbers
"""Number of values of a friction pair: state flag, frozen direction (3), given tilt."""
IN_MODE = tuple(run_records.MODE.at(name) for name in ("flag", "direction", "tilt"))
"""Indices of the values of a mode within the mode."""


@dataclass(frozen=True)
class Mode:
    """The mode of a friction pair, as stored in x (``tr_mode``).

    flag        a ``PairState``.
    direction   the pair's sliding rates at the time when the direction was frozen (3). A pair with fewer components uses only the
                first entries; a pair with a single component stores its sign.
    tilt        given tilt of a ball; 0: none."""

    flag: float
    direction: np.ndarray
    tilt: float


@dataclass(frozen=True)
class External:
    """Offsets in x for a system. tables: number of tables, inputs included; stops: number of stop flags; sliders: number of
    friction pairs."""

    tables: int
    stops: int
    sliders: int

    def table(self, index: int) -> int:
        """Index of the first value of a table."""
        return TIMES + TABLE * index

    def stop(self, index: int) -> int:
        """Index of the flag of a stop."""
        return self.table(self.tables) + index

    def mode(self, slider: int) -> int:
        """Index of the first value of a friction pair's mode."""
        return self.stop(self.stops) + MODE * slider

    def mode_in(self, x: np.ndarray, slider: int) -> Mode:
        """The mode of a friction pair, read from x."""
        flag, direction, tilt = (self.mode(slider) + at for at in IN_MODE)
        return Mode(float(x[flag]), x[direction:tilt].copy(), float(x[tilt]))

    @property
    def flags(self) -> slice:
        """The part of x that changes only at events: stop flags and modes."""
        return slice(self.stop(0), self.size)

    @property
    def size(self) -> int:
        """Length of x."""
        return self.mode(self.sliders)
