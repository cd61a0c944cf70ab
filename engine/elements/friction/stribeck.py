"""Stribeck's law: with increasing speed, friction falls from its static to its kinetic value and may then rise.

|k| = μ + (μ_static − μ) exp(−(v/v_stribeck)²) + viscosity · v while sliding, |k| ≤ μ_static at rest."""

from __future__ import annotations

from dataclasses import replace

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.elements.friction.friction_law import Law, Rest
from trunnion.elements.friction.law_parameters import MU, MU_STATIC, V_STRIBECK, VISCOSITY


class Stribeck(Law):
    """Set-valued at rest, like Coulomb's law. During sliding, |k| is smooth in v². The direction is fixed during a step, so k is
    smooth through v = 0. After release, friction falls continuously from μ_static."""

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
