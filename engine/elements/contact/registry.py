"""All contact elements, and queries by element name. A new element needs a new file and a line in ELEMENTS."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import TYPE_CHECKING

from trunnion.basics.number_declarations import Number, merged
from trunnion.basics.objects_by_import_path import objects
from trunnion.elements.contact.contact_element import ContactElement
from trunnion.elements.contact.geared_joint_friction import LOADED, LOADED_BACK
from trunnion.elements.contact.journal import PRELOAD
from trunnion.elements.contact.load_independent_friction import BOTH, CROSSED, SLIDING, TURNING
from trunnion.elements.contact.wrapped_band import BAND
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.friction import numbers as law_numbers

if TYPE_CHECKING:
    from trunnion.elements.contact.static_friction_capacity import Pair, Rubs


def registered(elements: Iterable[ContactElement]) -> dict[str, ContactElement]:
    """Elements by name. Raises ValueError if two elements have the same name, or if a size has two meanings."""
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
    "worm_thread.THREAD",
    "cam_follower.FOLLOWER",
    "plane_contact.PLANE",
    "gearbox_losses.GEAR_UNIT",
    "geared_joint_friction.LOADED_HINGE",
    "geared_joint_friction.LOADED_GUIDE",
    "wrapped_band.BAND",
    "wrapped_band.BELT",
    "load_independent_friction.TURNING",
    "load_independent_friction.SLIDING",
    "load_independent_friction.BOTH",
    "load_independent_friction.CROSSED",
)
REGISTRY: dict[str, ContactElement] = registered(objects(__package__, ELEMENTS))
CONSTANT = {(True,): TURNING.name, (False,): SLIDING.name, (False, True): BOTH.name, (True, True): CROSSED.name}
"""Names of the elements with load-independent friction. Keys: for each freedom of the joint, whether it is a rotation."""
GIVEN = frozenset(s.name for name in CONSTANT.values() for s in REGISTRY[name].sizes)
"""Names of the numbers that give a joint load-independent friction."""

BY_LOAD = frozenset((LOADED.name, LOADED_BACK.name))
"""Names of the numbers that give a joint friction that depends on the transmitted torque or force."""

WRAPPED = frozenset(s.name for s in BAND.sizes)
"""Names of the numbers that give a joint the friction of a band or belt."""


def preloads(n: Number, law: str, adams: bool) -> bool:
    """Whether joints with this law always have the number ``n`` (default 0), so that one primitive serves joints with and without
    preload."""
    return n.name == PRELOAD.name and LAWS[law].sets and not adams


def element_of(usual: str, turns: tuple[bool, ...], named: Iterable[str]) -> str:
    """Name of the contact element of a joint; "" if the joint has none. ``named``: names of the friction numbers that the scene
    gives for the joint. With a name in GIVEN, the element has load-independent friction; otherwise it is the joint type's ``usual``
    element. ``turns``: for each freedom, whether it is a rotation."""
    return CONSTANT.get(turns, "") if GIVEN & set(named) else usual


@cache
def sizes() -> dict[str, tuple[Number, tuple[str, ...]]]:
    """All sizes by name, each with the names of the elements that have this size."""
    return merged({e.name: e.sizes for e in REGISTRY.values()})


def pairs_at_rest(j: Rubs) -> list[Pair]:
    """The friction pairs of a joint whose law has static friction, in order."""
    return REGISTRY[j.contact].rests(j)
