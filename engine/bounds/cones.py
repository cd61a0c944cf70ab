"""The pairs of a mechanism at rest, and what they hold (``contact.resting``)."""

from __future__ import annotations

from engine.bounds.statics import Rubbing
from engine.contact.resting import Norm, Pair, Rubs, pairs_at_rest

__all__ = ["Norm", "Pair", "pairs"]


def pairs(joints: tuple[Rubbing, ...]) -> list[Pair]:
    """Every pair that can hold something, in the engine's order."""
    return [p for j in joints if j.holds for p in pairs_at_rest(_rubs(j))]


def _rubs(j: Rubbing) -> Rubs:
    e = j.element
    return Rubs(e.joint.name, e.friction.contact, e.needs, j.eta, j.sizes, j.sense, e.friction.adams)
