"""Coulomb's law, set-valued at rest: |k| = μ while sliding, any k up to the static one at rest (METHOD, "Why exact friction")."""

from __future__ import annotations

from dataclasses import replace

from engine.basics.symbolic import SX
from engine.friction.base import Law, Rest
from engine.friction.common import MU, MU_STATIC


class Coulomb(Law):
    """One sliding branch; rest is a constraint, which the runtime holds with a multiplier."""

    name = "coulomb"
    numbers = (MU, replace(MU_STATIC, needed=False))
    rest = Rest.SET_VALUED
    formula, at_rest = "μ v/|v|", "any |k| ≤ μ_s (μ_s = μ where it is not given)"

    def level(self, speed2: SX) -> SX:
        """μ at any speed."""
        return self.value["mu"]
