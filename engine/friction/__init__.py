"""Friction laws: how the friction ratio k follows from the sliding velocity. A new law is a new file and one registry line."""

from engine.friction.base import Law, Rest
from engine.friction.registry import DEFAULT, REGISTRY, exact_of, numbers, twin_of

__all__ = ["DEFAULT", "REGISTRY", "Law", "Rest", "exact_of", "numbers", "twin_of"]
