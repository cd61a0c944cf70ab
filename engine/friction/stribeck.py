"""Stribeck's law: friction falls from its static to its kinetic value as sliding sets in, and may rise again with speed.

|k| = μ + (μ_static − μ) exp(−(v/v_stribeck)²) + viscosity · v while sliding, any k up to μ_static at rest.
"""

from __future__ import annotations

from dataclasses import replace

from engine.basics.symbolic import SX, ca
from engine.friction.base import Law, Rest
from engine.friction.common import MU, MU_STATIC, V_STRIBECK, VISCOSITY


class Stribeck(Law):
    """Set-valued at rest as Coulomb's law is. While sliding it is smooth in v², so that within a step, where the direction is
    frozen, it is smooth through rest; after release, friction falls continuously from μ_static."""

    name = "stribeck"
    numbers = (MU, MU_STATIC, V_STRIBECK, replace(VISCOSITY, needed=False))
    rest = Rest.SET_VALUED
    dry = "coulomb"
    formula, at_rest = "(μ + (μ_s − μ) exp(−(v/v_S)²)) v/|v| + σ2 v", "any |k| ≤ μ_s"

    def level(self, speed2: SX) -> SX:
        """|k| at the given squared speed, without its viscous part."""
        n = self.value
        return n["mu"] + (n["mu_static"] - n["mu"]) * ca.exp(-speed2 / n["v_stribeck"] ** 2)

    @property
    def drag(self) -> SX | None:
        """The viscosity, s/m."""
        return self.value.get("viscosity")
