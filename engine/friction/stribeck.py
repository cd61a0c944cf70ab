"""Stribeck's law: friction falls from its static to its kinetic value as sliding sets in, and may rise again with speed.

|k| = μ + (μ_static − μ) exp(−(v/v_stribeck)²) + viscosity · v while sliding, any k up to μ_static at rest.
"""

import casadi as ca

from engine.friction.base import SX, Law


class Stribeck(Law):
    """Set-valued as Coulomb's law. The level is smooth in v², so that within a step, where the direction is frozen, the law is
    smooth through rest; after release friction falls continuously from μ_static."""

    name = "stribeck"
    sets = True

    @property
    def slope(self) -> None:
        """No proportional branch."""
        return

    def level(self, speed2: SX) -> SX:
        """Without the viscous part."""
        n = self.numbers
        return n["mu"] + (n["mu_static"] - n["mu"]) * ca.exp(-speed2 / n["v_stribeck"] ** 2)

    @property
    def drag(self) -> SX | None:
        """viscosity, s/m."""
        return self.numbers.get("viscosity")
