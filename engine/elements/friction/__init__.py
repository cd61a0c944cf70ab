"""Friction laws: the friction ratio k as a function of the sliding velocity. A new law needs a new file and a line in the
registry."""

from trunnion.elements.friction.friction_law import Law, Rest
from trunnion.elements.friction.registry import DEFAULT, REGISTRY, exact_of, numbers, twin_of

__all__ = ["DEFAULT", "REGISTRY", "Law", "Rest", "exact_of", "numbers", "twin_of"]
