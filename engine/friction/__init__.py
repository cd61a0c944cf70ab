"""Friction laws: how the friction ratio k follows from the sliding velocity. A new law is a new file and one registry line."""

from engine.friction.base import Law
from engine.friction.coulomb import Coulomb
from engine.friction.lugre import LuGre
from engine.friction.regularized import Regularized
from engine.friction.stribeck import Stribeck
from engine.friction.viscous import Viscous

REGISTRY: dict[str, type[Law]] = {law.name: law for law in (Coulomb, LuGre, Regularized, Stribeck, Viscous)}

__all__ = ["REGISTRY", "Law"]
