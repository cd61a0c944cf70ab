"""Coulomb's law, set-valued at rest: |k| = μ while sliding, |k| ≤ μ_s at rest (theory, "Why exact friction")."""

from __future__ import annotations

from dataclasses import replace

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.monotone_curves import KNOTS, monotone
from trunnion.elements.friction.friction_law import TINY, Law, Rest
from trunnion.elements.friction.law_parameters import MU, MU_STATIC

BY_SPEED = tuple((f"speed[{k}]", f"mu[{k}]") for k in range(2, KNOTS + 1))
"""Names of the speeds and coefficients that define a curve of μ over speed, from the second point on. The coefficient at rest is
mu."""


class Coulomb(Law):
    """Coulomb's law has a single branch, for sliding. At rest, the runtime holds the pair by a constraint with a multiplier."""

    name = "coulomb"
    numbers = (MU, replace(MU_STATIC, needed=False))
    rest = Rest.SET_VALUED
    formula, at_rest = "μ v/|v|", "any |k| ≤ μ_s (μ_s = μ where it is not given)"

    def level(self, speed2: SX) -> SX:
        """The coefficient μ: a constant, or the value of its curve at the speed."""
        n = self.value
        if BY_SPEED[0][1] not in n:
            return n["mu"]
        at = [ca.SX(0), *(n[speed] for speed, _ in BY_SPEED)]
        return monotone(ca.sqrt(speed2 + TINY), at, [n["mu"], *(n[mu] for _, mu in BY_SPEED)], flat=False)
