"""Where things are in x, the external values a system's functions take: the one description of it in Python.

x = [t, ts | tables | stop flags | modes]. t: time, s; ts: a time inside the current step, s, which alone chooses the branch of a
signal. Tables: value and three derivatives each; external inputs are the first tables. Stop flags: 1 while engaged. Modes: a state
flag, a frozen direction and a given tilt for every sliding pair (see ``elements.friction.friction_law``). The records are
``tr_moment``, ``tr_signal`` and ``tr_mode`` of ``trunnion.runtime.abi``; a kernel whose x has another length is refused when its
block is made. """

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trunnion.runtime.abi import run_records

TIMES = run_records.MOMENT.numbers
"""Numbers before the tables: t and ts."""
NOW, INSIDE = run_records.MOMENT.at("t"), run_records.MOMENT.at("inside")
"""Where t and ts are."""
TABLE = run_records.SIGNAL.numbers
"""Numbers per table: value and three derivatives."""
MODE = run_records.MODE.numbers
"""Numbers per sliding pair: state flag, frozen direction (3), given tilt."""


@dataclass(frozen=True)
class Mode:
    """The mode of a sliding pair, as it lies in x (``tr_mode``). flag: a ``PairState``; direction: its rates when the direction was
    frozen (3, of which a pair of fewer components uses the first; of one component: its sign); tilt: of a ball."""

    flag: float
    direction: np.ndarray
    tilt: float


@dataclass(frozen=True)
class External:
    """Offsets in x, for a system with ``tables`` tables (inputs included), ``stops`` flags of stops and ``sliders`` sliding
    pairs."""

    tables: int
    stops: int
    sliders: int

    def table(self, index: int) -> int:
        """Where the numbers of a table begin."""
        return TIMES + TABLE * index

    def stop(self, index: int) -> int:
        """Where the flag of a stop is."""
        return self.table(self.tables) + index

    def mode(self, slider: int) -> int:
        """Where the numbers of a sliding pair's mode begin."""
        return self.stop(self.stops) + MODE * slider

    def mode_in(self, x: np.ndarray, slider: int) -> Mode:
        """The mode of a sliding pair in x."""
        record = np.ascontiguousarray(x[self.mode(slider) : self.mode(slider) + MODE]).view(run_records.MODE.dtype)[0]
        return Mode(float(record["flag"]), np.array(record["direction"]), float(record["tilt"]))

    @property
    def flags(self) -> slice:
        """The part of x that changes only at events: stop flags and modes."""
        return slice(self.stop(0), self.size)

    @property
    def size(self) -> int:
        """Length of x."""
        return self.mode(self.sliders)
