"""The contact elements there are, and the questions the rest of the product asks about them by name."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from engine.basics.numbers import Number, merged
from engine.contact.ball import BALL
from engine.contact.base import ContactElement
from engine.contact.cross import CROSS
from engine.contact.journal import JOURNAL, SHAFT
from engine.contact.sleeve import SLEEVE
from engine.friction import numbers as law_numbers

if TYPE_CHECKING:
    from engine.contact.resting import Pair, Rubs


def registered(elements: Iterable[ContactElement]) -> dict[str, ContactElement]:
    """Elements by name. ValueError when two have one name, or a size means two things."""
    out: dict[str, ContactElement] = {}
    for e in elements:
        if e.name in out:
            raise ValueError(f"two contact elements are called {e.name}")
        out[e.name] = e
    for name, (_, who) in merged({e.name: e.sizes for e in out.values()}).items():
        if name in law_numbers():
            raise ValueError(f"contact element {who[0]}: {name} is a number of friction laws already")
    return out


REGISTRY = registered((JOURNAL, SHAFT, BALL, CROSS, SLEEVE))


def sizes() -> dict[str, tuple[Number, tuple[str, ...]]]:
    """Every size a contact element has, by name, each with the elements that have it."""
    return merged({e.name: e.sizes for e in REGISTRY.values()})


def pairs_at_rest(j: Rubs) -> list[Pair]:
    """The pairs of a joint whose law holds something at rest, in the engine's order."""
    return REGISTRY[j.contact].rests(j)
