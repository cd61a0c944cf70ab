"""Coulomb's law, set-valued at rest: |k| = μ while sliding, any k up to the static one at rest (METHOD, "Why exact friction")."""

from engine.friction.base import SX, Law


class Coulomb(Law):
    """Sliding has one branch; rest is a constraint with its multiplier, kept by the runtime."""

    name = "coulomb"
    sets = True

    @property
    def slope(self) -> None:
        """No proportional branch."""
        return

    def level(self, speed2: SX) -> SX:
        """μ."""
        return self.numbers["mu"]
