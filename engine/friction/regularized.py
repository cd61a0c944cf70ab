"""Rooney and Deravi's continuous law (104): μ |v|/v_eps up to v_eps, μ beyond."""

from __future__ import annotations

from engine.basics.symbolic import SX
from engine.friction.base import Law, Rest
from engine.friction.common import MU, V_EPS


class Regularized(Law):
    """Flag 1: saturated, 0: proportional."""

    name = "regularized"
    numbers = (MU, V_EPS)
    rest = Rest.KINK
    exact = dry = "coulomb"
    steps = False
    formula, at_rest = "(104): μ min(|v|/v_eps, 1) v/|v|", "0"

    def slope(self, speed2: SX) -> SX:
        """μ/v_eps, s/m."""
        return self.value["mu"] / self.value["v_eps"]

    def level(self, speed2: SX) -> SX:
        """μ."""
        return self.value["mu"]

    @property
    def kink(self) -> SX:
        """v_eps, m/s."""
        return self.value["v_eps"]
