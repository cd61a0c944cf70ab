"""How many floating-point operations parts of a step take: those of the generated functions, counted as they are made, and those
of the dense algebra between them, by its sizes. Bounded steps are measured in these, so that figures are the same everywhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Work:
    """Operations of the parts that a bounded step counts, and of what it takes beside them.

    evaluation  of the right-hand side, its friction apart; maps formed by themselves, with what corrects positions, are less
    iteration   of Newton's method on the complement equations; what a decision takes beside its iterations is one more
    relaxed     a step whose friction is found by sweeps
    row         the columns, once
    """

    evaluation: int
    iteration: int
    relaxed: int
    row: int

    def of(self, evaluations: float, iterations: float, relaxed: float = 0.0) -> float:
        """Operations of a step that took so many."""
        return self.evaluation * evaluations + self.iteration * iterations + self.relaxed * relaxed + self.row


SWEEPS, BESIDE, ROW, IMPULSES = 6, 2, (6, 14), 4
"""Of the runtime (``bounded.c``): sweeps of a relaxed step; evaluations of one; evaluations and iterations that a row may take
besides; evaluations that a step of impulses may."""


def work(operations: Mapping[str, int], sizes: Mapping[str, int]) -> Work:
    """From what a compiled kernel says of itself: ``facts["operations"]`` and its sizes."""
    a, e, n, pairs = (sizes[k] for k in ("active", "neta", "nn", "nsliders"))
    factor = a**3 // 3 + 2 * a**2
    eliminate = 2 * a**2 * (1 + e) + 2 * a * (1 + e) * (n + e)
    stages = operations["stage1"] + 2 * operations["stage2"] + operations["closure"]
    evaluation = stages + factor + eliminate + 2 * (n + e) * e
    iteration = operations["laws"] + operations["held"] + 2 * n * e + 2 * sizes["ndn"] * e + 2 * e**3 // 3 + 4 * e**2
    sweep = operations["laws"] + 2 * n * e + pairs * operations["held"] + 2 * e**2
    return Work(evaluation, iteration, BESIDE * evaluation + SWEEPS * sweep, operations["outputs"])


def most(w: Work, evaluations: int, iterations: int, pairs: int) -> int:
    """Most operations of a bounded step that may take so many. pairs: of sliding surfaces, whose rates are asked for apart."""
    beside = IMPULSES + ROW[0] + 2 * (pairs + 1)
    return int(w.of(evaluations + beside, iterations + ROW[1] + pairs + 1, relaxed=1.0))
