"""All contact elements, and questions about an element by its name. A new element is a new file and one line of ELEMENTS."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from trunnion.basics.number_declarations import Number, merged
from trunnion.basics.object_paths import objects
from trunnion.elements.contact.constant_friction import BOTH, CROSSED, SLIDING, TURNING
from trunnion.elements.contact.contact_element import ContactElement
from trunnion.elements.contact.journal import PRELOAD
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.friction import numbers as law_numbers

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs


def registered(elements: Iterable[ContactElement]) -> dict[str, ContactElement]:
    """Elements by name. ValueError when two have one name, or a size has two meanings."""
    out: dict[str, ContactElement] = {}
    for e in elements:
        if e.name in out:
            raise ValueError(f"two contact elements are called {e.name}")
        out[e.name] = e
    for name, (_, who) in merged({e.name: e.sizes for e in out.values()}).items():
        if name in law_numbers():
            raise ValueError(f"contact element {who[0]}: {name} is a number of friction laws already")
    return out


ELEMENTS = (
    "journal.JOURNAL",
    "shaft.SHAFT",
    "ball_in_socket.BALL",
    "universal_cross.CROSS",
    "rectangular_sleeve.SLEEVE",
    "screw_thread.THREAD",
    "gear_teeth.TEETH",
    "gear_teeth.CONES",
    "cam_follower.FOLLOWER",
    "constant_friction.TURNING",
    "constant_friction.SLIDING",
    "constant_friction.BOTH",
    "constant_friction.CROSSED",
)
REGISTRY: dict[str, ContactElement] = registered(objects(__package__, ELEMENTS))
CONSTANT = {(True,): TURNING.name, (False,): SLIDING.name, (False, True): BOTH.name, (True, True): CROSSED.name}
"""Elements of load-independent friction, by whether the joint's freedoms turn."""
GIVEN = frozenset(s.name for name in CONSTANT.values() for s in REGISTRY[name].sizes)
"""Numbers that give a joint such friction."""


def preloads(n: Number, law: str, adams: bool) -> bool:
    """Whether joints with this law always have the number (0 by default), so that one primitive serves with and without preload."""
    return n.name == PRELOAD.name and LAWS[law].sets and not adams


def element_of(usual: str, turns: tuple[bool, ...], named: Iterable[str]) -> str:
    """Name of the contact element for these numbers of a joint's friction: that of load-independent friction where they give it,
    else the type's usual one; "" if there is none. turns: whether each freedom turns."""
    return CONSTANT.get(turns, "") if GIVEN & set(named) else usual


def sizes() -> dict[str, tuple[Number, tuple[str, ...]]]:
    """All sizes by name, each with the elements that have it."""
    return merged({e.name: e.sizes for e in REGISTRY.values()})


def pairs_at_rest(j: Rubs) -> list[Pair]:
    """Friction pairs of a joint whose law has static friction, in order."""
    return REGISTRY[j.contact].rests(j)
