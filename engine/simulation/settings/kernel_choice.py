"""The default kernel. It depends on structure and request alone, so that the same request gives the same bits, whatever kernels
are cached."""

from __future__ import annotations

from trunnion.simulation.settings.run_settings import KERNELS
from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.loop_matrix_fill import fill

MANY = 14
"""Friction multipliers of a tree from which the bytecode kernel is faster. Code and time of compiled maps grow with their square
(22 s to compile for 16 pins); along the recursion the cost is linear (``tests/benchmarks/speed/parts_kernel.py``)."""
RUNS = 1000
"""Runs of one structure from which its compilation (0.5 to 3 s) pays: a run takes about 1 ms longer on bytecode."""


def kernel_for(wanted: str | None, system: System, runs: float = 1) -> str:
    """The kind of kernel of a request; None or "auto": the default one. A single run has no lanes."""
    if wanted in (None, KERNELS[0]):
        return kernel_of(system, runs)[0]
    return "compiled" if wanted == "lanes" else wanted


def kernel_of(system: System, runs: float = 1) -> tuple[str, str]:
    """(default kind of kernel, reason) for a structure. runs: expected number of runs; infinite for open-ended stepping."""
    if not system.cuts and system.neta >= MANY:
        return "parts", f"a tree with {system.neta} friction multipliers"
    if system.cuts and fill(system, range(system.rows)).below:
        return "parts", f"loops with {system.rows} constraint rows and sparse equations"
    if runs < RUNS:
        return "parts", "a compilation takes longer than it saves in one run" if runs == 1 else f"fewer than {RUNS} runs"
    return "compiled", "a compilation saves more time than it takes in many steps"
