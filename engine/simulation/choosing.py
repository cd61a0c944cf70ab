"""Which kernel evaluates a scene where nobody says: by its structure and by what is asked alone, so that the same request gives the
same bits, whatever is cached."""

from __future__ import annotations

from engine.simulation.settings import KERNELS
from engine.system.coupling import fill
from engine.system.structure import System

MANY = 14
"""Multipliers of friction on a tree. Compiled maps take time and code that grow with their square (22 s to compile for 16 pins);
along the recursion a step costs the same for each body, less than compiled from here on (``tests/benchmarks/parts.py``)."""
RUNS = 1000
"""Runs of one structure for which compiling it (0.5 to 3 s) pays: one takes a millisecond or so longer on parts."""


def kernel_for(asked: str | None, system: System, runs: float = 1) -> str:
    """The kind of kernel asked for, or, where that is none or "auto", the usual one; one run has no lanes beside it."""
    if asked in (None, KERNELS[0]):
        return kernel_of(system, runs)[0]
    return "compiled" if asked == "lanes" else asked


def kernel_of(system: System, runs: float = 1) -> tuple[str, str]:
    """(kind of kernel, why) for a structure that a request runs so many times (infinity: for as long as its user likes)."""
    if not system.cuts and system.neta >= MANY:
        return "parts", f"a tree with {system.neta} frictions"
    if system.cuts and fill(system, range(system.rows)).below:
        return "parts", f"loops with {system.rows} rows, few of which meet"
    if runs < RUNS:
        return "parts", "nothing is compiled for one run" if runs == 1 else f"fewer than {RUNS} runs"
    return "compiled", "it is stepped for long"
