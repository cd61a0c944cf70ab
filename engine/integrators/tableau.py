"""Explicit Runge–Kutta methods as data. A tableau checks its own order conditions when it is made; C code is written from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Tableau:
    """An explicit pair with dense output.

    A: rows of the stages (row i has i entries), B: weights, C: nodes; E: one or two error estimators over the stages (the first
    may have one entry more, for the derivative at the end of the step); A_dense, C_dense: extra stages of the dense output;
    D: rows of dense output beyond cubic Hermite, over stages, end derivative and extra stages.
    """

    name: str
    order: int
    A: Sequence[Sequence[float]]
    B: Sequence[float]
    C: Sequence[float]
    E: Sequence[Sequence[float]]
    A_dense: Sequence[Sequence[float]]
    C_dense: Sequence[float]
    D: Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        problem = self.defect()
        if problem > 1e-13:
            raise ValueError(f"tableau {self.name}: order conditions violated by {problem:.1e}")

    @property
    def stages(self) -> int:
        """Number of stages of a step."""
        return len(self.B)

    def defect(self) -> float:
        """Largest violation of: row sums, quadrature conditions Σ b c^(k−1) = 1/k to the order, Σ E = 0, and the conditions
        Σ b_i a_ij c_j^(k−1) = 1/(k (k+1))."""
        c, b = self.C, self.B
        worst = max(abs(sum(row) - ci) for row, ci in zip(self.A, c, strict=True))
        for k in range(1, self.order + 1):
            worst = max(worst, abs(sum(bi * ci ** (k - 1) for bi, ci in zip(b, c, strict=True)) - 1 / k))
        for k in range(1, self.order):
            inner = [sum(a * cj ** (k - 1) for a, cj in zip(row, c, strict=False)) for row in self.A]
            total = sum(bi * x for bi, x in zip(b, inner, strict=True))
            worst = max(worst, abs(total - 1 / (k * (k + 1))))
        dense = [abs(sum(row) - ci) for row, ci in zip(self.A_dense, self.C_dense, strict=True)]
        return max([worst, *(abs(sum(e)) for e in self.E), *dense])
