"""Rosenbrock methods as data, in the form with one matrix W = E/(γh) − J and without matrix–vector products.

Stages: W k_i = f(t + c_i h, y + Σ a_ij k_j) + h d_i ∂f/∂t + Σ C_ij k_j / h.

Solution: y₁ = y + Σ b_j k_j, where b is the last row of A followed by 1. The error is the last stage, k_s.

Dense output: y(θ) = (1−θ) y + θ (y₁ + (1−θ)(K₁ + θ (K₂ + θ K₃))), K_r = Σ H_ri k_i.
"""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.integrators.order_conditions import PARTS, Elementary, Matrix, carried

ROUND_OFF = 1e-11
"""Largest violation of the conditions on nodes, on d and on stability that is round-off, amplified by a matrix inverse."""
HERMITE = 3
"""Number of rows of H."""


@dataclass(frozen=True)
class Rosenbrock:
    """A stiffly accurate Rosenbrock method. The module's docstring defines the coefficients."""

    name: str
    about: str
    order: int
    error_order: int
    dense_order: int
    gamma: float
    A: Sequence[Sequence[float]]
    C: Sequence[Sequence[float]]
    c: Sequence[float]
    d: Sequence[float]
    H: Sequence[Sequence[float]]

    def check(self) -> None:
        """Runs before the method becomes C code. Raises ValueError if the coefficients do not give the declared order, error_order
        (of the estimator) and dense_order. Also raises ValueError if the nodes c and the factors d do not follow from A, C and γ.
        Also raises ValueError if the stability function does not vanish at infinity."""
        problem = self.defect()
        if problem > ROUND_OFF:
            raise ValueError(f"method {self.name}: the conditions on nodes and stability are violated by {problem:.1e}")
        for what, value in self._derived().items():
            if getattr(self, what) != value:
                raise ValueError(f"method {self.name}: its coefficients give {what} = {value}, declared: {getattr(self, what)}")

    @property
    def stages(self) -> int:
        """Number of stages."""
        return len(self.c)

    @property
    def end(self) -> int:
        """Row of K with the derivative at the end of the step. Earlier rows contain f(t, y) and the stages."""
        return self.stages + 1

    @property
    def rows(self) -> int:
        """Number of rows of K."""
        return self.stages + 2

    def weights(self) -> list[float]:
        """b: the last row of A, followed by 1 for the last stage."""
        return [*self.A[-1], 1.0]

    def classical(self) -> tuple[Matrix, Matrix, list[float], Matrix]:
        """The coefficients (α, β, b, Γ) of the classical form, with Γ = (E/γ − C)⁻¹ and β = α + Γ."""
        gamma = inverse(self.gamma, self.C)
        alpha = [by(row, gamma) for row in self.A]
        beta = [[a + g for a, g in zip(x, y, strict=True)] for x, y in zip(alpha, gamma, strict=True)]
        return alpha, beta, by(self.weights(), gamma), gamma

    def defect(self) -> float:
        """Largest violation of the conditions on the nodes c, on the factors d, and on stability at infinity (b β⁻¹ 1 = 1)."""
        alpha, beta, b, gamma = self.classical()
        ones = [1.0] * self.stages
        worst = max(abs(x - c) for x, c in zip(carried(alpha, ones), self.c, strict=True))
        worst = max(worst, *(abs(x - d) for x, d in zip(carried(gamma, ones), self.d, strict=True)))
        u: list[float] = []  # solves β u = 1 for lower triangular β
        for i, row in enumerate(beta):
            u.append((1.0 - sum(r * x for r, x in zip(row, u, strict=False))) / row[i])
        return max(worst, abs(1.0 - sum(w * x for w, x in zip(b, u, strict=True))))

    def _derived(self) -> dict[str, int]:
        """Orders of solution, error estimator and dense output, computed from the coefficients."""
        alpha, beta, b, gamma = self.classical()
        phi = Elementary(beta, alpha)

        def dense(theta: float) -> list[float]:
            rows = zip(self.weights(), *self.H, strict=True)
            return by([theta * (w + (1 - theta) * (p + theta * (q + theta * r))) for w, p, q, r in rows], gamma)

        return {
            "order": phi.order(lambda _: b),
            "error_order": phi.order(lambda _: gamma[-1], exact=False),
            "dense_order": phi.order(dense, PARTS),
        }


def by(row: Sequence[float], matrix: Matrix) -> list[float]:
    """Product of a row and a square matrix. If the row is shorter than the matrix, it is padded with zeros."""
    return [sum(a * m[k] for a, m in zip(row, matrix, strict=False)) for k in range(len(matrix))]


def inverse(gamma: float, C: Matrix) -> list[list[float]]:
    """(E/γ − C)⁻¹ for strictly lower triangular C."""
    out: list[list[float]] = []
    for i, row in enumerate(C):
        unit = [float(k == i) for k in range(len(C))]
        out.append([gamma * (e + sum(c * x[k] for c, x in zip(row, out, strict=False))) for k, e in enumerate(unit)])
    return out
