"""The contact elements there are, and the questions the rest of the product asks about them by name."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from engine.basics.numbers import Number, merged
from engine.contact.ball import BALL
from engine.contact.base import ContactElement
from engine.contact.constant import BOTH, CROSSED, SLIDING, TURNING
from engine.contact.cross import CROSS
from engine.contact.follower import FOLLOWER
from engine.contact.journal import JOURNAL, PRELOAD
from engine.contact.shaft import SHAFT
from engine.contact.sleeve import SLEEVE
from engine.contact.teeth import CONES, TEETH
from engine.contact.thread import THREAD
from engine.friction import REGISTRY as LAWS
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


REGISTRY = registered((JOURNAL, SHAFT, BALL, CROSS, SLEEVE, THREAD, TEETH, CONES, FOLLOWER, TURNING, SLIDING, BOTH, CROSSED))
CONSTANT = {(True,): TURNING.name, (False,): SLIDING.name, (False, True): BOTH.name, (True, True): CROSSED.name}
"""Elements of friction that does not follow the load, by whether the freedoms of their joint turn."""
GIVEN = frozenset(s.name for name in CONSTANT.values() for s in REGISTRY[name].sizes)
"""Numbers by which a joint says that it has such friction."""


def preloads(n: Number, law: str, adams: bool) -> bool:
    """Whether a number is there for every joint with this law, 0 where none is given: one part then does with a preload and
    without."""
    return n.name == PRELOAD.name and LAWS[law].sets and not adams


def element_of(usual: str, turns: tuple[bool, ...], named: Iterable[str]) -> str:
    """Name of the element of a joint whose friction gives these numbers: the usual one of its type, or where it says that its
    friction does not follow the load that of its freedoms (which of them turn); "" when it can have none."""
    return CONSTANT.get(turns, "") if GIVEN & set(named) else usual


def sizes() -> dict[str, tuple[Number, tuple[str, ...]]]:
    """Every size a contact element has, by name, each with the elements that have it."""
    return merged({e.name: e.sizes for e in REGISTRY.values()})


def pairs_at_rest(j: Rubs) -> list[Pair]:
    """The pairs of a joint whose law holds something at rest, in the engine's order."""
    return REGISTRY[j.contact].rests(j)
