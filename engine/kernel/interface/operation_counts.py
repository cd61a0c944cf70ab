"""Numbers of floating-point operations of the parts of a step. Operations of generated functions are counted. Operations of dense
algebra are computed from sizes. The numbers measure the cost of real-time steps independently of the machine."""

from __future__ import annotations

from collections.abc import Mapping

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.abi.header_constants import number


@dataclass(frozen=True)
class Work:
    """Operations of the parts of a bounded step.

    evaluation: one right-hand side without friction. The number is also an upper bound for the maps, and for a correction of
    positions.

    iteration: one Newton iteration on the complement equations. A decision costs one more iteration.

    relaxed: one step whose friction is solved by sweeps instead of Newton iterations.

    row: one evaluation of the columns.
    """

    evaluation: int
    iteration: int
    relaxed: int
    row: int

    def of(self, evaluations: float, iterations: float, relaxed: float = 0.0) -> float:
        """Operations of a step with these numbers of evaluations, iterations and relaxed steps."""
        return self.evaluation * evaluations + self.iteration * iterations + self.relaxed * relaxed + self.row


SWEEPS, IMPULSES, ROW_ITERATIONS = (int(number(n)) for n in ("SWEEPS", "IMPULSE_EVALUATIONS", "ROW_ITERATIONS"))
BESIDE = 2
ROW = IMPULSES + BESIDE, ROW_ITERATIONS + SWEEPS
"""Constants of ``realtime_steps.c``. SWEEPS: number of sweeps of a relaxed step. IMPULSES: additional evaluations of an impulse
step. BESIDE: evaluations of a relaxed step. ROW: additional evaluations and iterations of a row."""


def work(operations: Mapping[str, int], sizes: Mapping[str, int]) -> Work:
    """Operations of the parts, from the facts (``facts["operations"]``) and the sizes of a compiled kernel."""
    a, e, n, pairs = (sizes[k] for k in ("active", "neta", "nn", "nsliders"))
    factor = a**3 // 3 + 2 * a**2
    eliminate = 2 * a**2 * (1 + e) + 2 * a * (1 + e) * (n + e)
    stages = operations["stage1"] + 2 * operations["stage2"] + operations["closure"]
    evaluation = stages + factor + eliminate + 2 * (n + e) * e
    iteration = operations["laws"] + operations["held"] + 2 * n * e + 2 * sizes["ndn"] * e + 2 * e**3 // 3 + 4 * e**2
    sweep = operations["laws"] + 2 * n * e + pairs * operations["held"] + 2 * e**2
    return Work(evaluation, iteration, BESIDE * evaluation + SWEEPS * sweep, operations["outputs"])


def most(w: Work, evaluations: int, iterations: int, pairs: int) -> int:
    """Largest number of operations of a real-time step with these bounds. pairs: number of friction pairs. The rates of friction
    pairs need additional evaluations."""
    beside = IMPULSES + ROW[0] + 2 * (pairs + 1)
    return int(w.of(evaluations + beside, iterations + ROW[1] + pairs + 1, relaxed=1.0))
