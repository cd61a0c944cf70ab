"""Rosenbrock methods as data, in the form with one matrix W = E/(γh) − J and no matrix–vector products:

W k_i = f(t + c_i h, y + Σ a_ij k_j) + h d_i ∂f/∂t + Σ C_ij k_j / h,   y₁ = y + Σ b_j k_j with b the last row of A and 1,
error = k_s, dense output y(θ) = (1−θ) y + θ (y₁ + (1−θ)(K₁ + θ (K₂ + θ K₃))), K_r = Σ H_ri k_i.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Rosenbrock:
    """A stiffly accurate method. It checks itself: order conditions to 5 on its classical form, and R(∞) = 0."""

    name: str
    order: int
    gamma: float
    A: Sequence[Sequence[float]]
    C: Sequence[Sequence[float]]
    c: Sequence[float]
    d: Sequence[float]
    H: Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        problem = self.defect()
        if problem > 1e-11:
            raise ValueError(f"method {self.name}: conditions violated by {problem:.1e}")

    @property
    def stages(self) -> int:
        """Number of stages."""
        return len(self.c)

    def weights(self) -> np.ndarray:
        """b: the last row of A, and 1 for the last stage."""
        return np.array([*self.A[-1], 1.0])

    def classical(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(α, β = α + Γ, b) of the classical form, from Γ = (E/γ − C)⁻¹."""
        s = self.stages
        a, c = np.zeros((s, s)), np.zeros((s, s))
        for i, (ra, rc) in enumerate(zip(self.A, self.C, strict=True)):
            a[i, : len(ra)], c[i, : len(rc)] = ra, rc
        gamma = np.linalg.inv(np.eye(s) / self.gamma - c)
        alpha = a @ gamma
        return alpha, alpha + gamma, self.weights() @ gamma

    def defect(self) -> float:
        """Largest violation of: nodes, d, quadrature order, Σ b β c̃ conditions, stability at infinity."""
        alpha, beta, b = self.classical()
        ones = np.ones(self.stages)
        node, gam = alpha @ ones, (beta - alpha) @ ones
        worst = max(np.abs(node - self.c).max(), np.abs(gam - self.d).max())
        for k in range(1, self.order + 1):
            worst = max(worst, abs(b @ node ** (k - 1) - 1 / k))
        power = ones
        for k in range(1, self.order + 1):
            worst = max(worst, abs(b @ power - 1 / np.prod(np.arange(1, k + 1))))
            power = beta @ power
        worst = max(worst, abs(1 - b @ np.linalg.solve(beta, ones)))
        return float(worst)
