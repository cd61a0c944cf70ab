"""Choice of the default kernel. The choice depends only on structure and request, so that the same request gives bitwise the same
results with any cached kernels."""

from __future__ import annotations

from trunnion.simulation.settings.run_settings import KERNELS
from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.loop_matrix_fill import fill

MANY = 14
"""For a tree with this many friction multipliers or more, the bytecode kernel is faster. Size and run time of compiled maps are
quadratic in this number (22 s to compile for 16 pins). Bytecode along the recursion has linear cost
(``tests/benchmarks/speed/parts_kernel.py``)."""
RUNS = 1000
"""With this many runs of a structure or more, a compilation (0.5 to 3 s) saves time. With bytecode, a run takes about 1 ms
longer."""


def kernel_for(wanted: str | None, system: System, runs: float = 1) -> str:
    """The kind of kernel for a request. wanted: None or "auto" selects the default kind; "lanes" becomes "compiled", because a
    single run has no lanes."""
    if wanted in (None, KERNELS[0]):
        return kernel_of(system, runs)[0]
    return "compiled" if wanted == "lanes" else wanted


def kernel_of(system: System, runs: float = 1) -> tuple[str, str]:
    """(default kind of kernel, reason) for a structure. runs: expected number of runs; infinite for stepping without a known
    end."""
    if not system.cuts and system.neta >= MANY:
        return "parts", f"a tree with {system.neta} friction multipliers"
    if system.cuts and fill(system, range(system.rows)).below:
        return "parts", f"loops with {system.rows} constraint rows and sparse equations"
    if runs < RUNS:
        return "parts", "a compilation takes longer than it saves in one run" if runs == 1 else f"fewer than {RUNS} runs"
    return "compiled", "a compilation saves more time than it takes in many steps"
