"""Rooney and Deravi's continuous law (104): μ |v|/v_eps up to v_eps, μ beyond."""

from engine.friction.base import SX, Law


class Regularized(Law):
    """Flag 1: saturated, 0: proportional."""

    name = "regularized"
    kinks = True

    @property
    def slope(self) -> SX:
        """μ/v_eps, s/m."""
        return self.numbers["mu"] / self.numbers["v_eps"]

    def level(self, speed2: SX) -> SX:
        """μ."""
        return self.numbers["mu"]

    @property
    def kink(self) -> SX:
        """v_eps, m/s."""
        return self.numbers["v_eps"]
