"""Lubricated contact: the friction ratio is proportional to the sliding speed, k = viscosity · v (viscosity in s/m).

The friction force is still proportional to the normal force. For drag independent of the normal force, use the joint's ``damping``.
"""

from __future__ import annotations

from trunnion.basics.lazy_casadi import SX
from trunnion.elements.friction.friction_law import Law, Rest
from trunnion.elements.friction.law_parameters import VISCOSITY


class Viscous(Law):
    """The law has only a proportional branch, and no kink."""

    name = "viscous"
    numbers = (VISCOSITY,)
    rest = Rest.SMOOTH
    scale = "viscosity"
    formula, at_rest = "σ2 v", "0"

    def slope(self, speed2: SX) -> SX:
        """The viscosity, s/m."""
        return self.value["viscosity"]
