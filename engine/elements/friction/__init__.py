"""Friction laws: how the friction ratio k follows from the sliding velocity. A new law is a new file and one registry line."""

from trunnion.elements.friction.friction_law import Law, Rest
from trunnion.elements.friction.registry import DEFAULT, REGISTRY, exact_of, numbers, twin_of

__all__ = ["DEFAULT", "REGISTRY", "Law", "Rest", "exact_of", "numbers", "twin_of"]
