"""Rooney and Deravi's continuous law, the paper's (104): |k| = μ |v|/v_eps up to the speed v_eps, μ beyond."""

from __future__ import annotations

from trunnion.basics.lazy_casadi import SX
from trunnion.elements.friction.friction_law import Law, Rest
from trunnion.elements.friction.law_parameters import MU, V_EPS


class Regularized(Law):
    """The law has two branches, selected by the flag: 1 for saturated friction, 0 for friction proportional to the velocity."""

    name = "regularized"
    numbers = (MU, V_EPS)
    rest = Rest.KINK
    exact = dry = "coulomb"
    steps = False
    formula, at_rest = "(104): μ min(|v|/v_eps, 1) v/|v|", "0"

    def slope(self, speed2: SX) -> SX:
        """μ/v_eps, s/m, on the proportional branch."""
        return self.value["mu"] / self.value["v_eps"]

    def level(self, speed2: SX) -> SX:
        """μ on the saturated branch."""
        return self.value["mu"]

    @property
    def kink(self) -> SX:
        """v_eps, m/s, the speed at which the branches meet."""
        return self.value["v_eps"]
