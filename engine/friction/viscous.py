"""Lubricated contact: friction ratio proportional to sliding speed, k = viscosity · v (viscosity in s/m).

The friction force still follows the normal force. For a drag that does not, give the joint ``damping`` instead.
"""

from engine.friction.base import SX, Law


class Viscous(Law):
    """No branch, no kink."""

    name = "viscous"

    @property
    def slope(self) -> SX:
        """viscosity, s/m."""
        return self.numbers["viscosity"]

    def level(self, speed2: SX) -> None:
        """No sliding branch."""
        return
