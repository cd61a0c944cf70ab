"""Friction of a scene's joints: the contact element of the joint type, or constant friction independent of the load."""

from __future__ import annotations

from trunnion.basics.number_declarations import Number
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact import ContactElement, element_of
from trunnion.elements.contact.registry import BY_LOAD, CONSTANT, WRAPPED
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.joints import Friction, Joint


def named(f: Friction) -> set[str]:
    """The names of the keys that a joint's friction gives."""
    return {name for name, value in vars(f).items() if value is not None}


def sizes_given(f: Friction, element: ContactElement) -> dict[str, float]:
    """{label: size, m} for the sizes that a joint's friction gives to a contact element. A size may have several labels; a single
    number then applies to all of them. Sizes that depend on time or an input are omitted."""
    out: dict[str, float] = {}
    for s in element.sizes:
        value = getattr(f, s.name)
        if value is not None:
            values = value if isinstance(value, tuple) else (value,) * s.count
            out |= {label: float(v) for label, v in zip(s.labels, values, strict=True) if isinstance(v, float | int)}
    return out


def touching(j: Joint) -> ContactElement | None:
    """The contact element of a joint with friction; None if the joint type does not support this friction."""
    assert j.friction is not None
    kind = REGISTRY[j.type]
    for names, element in ((BY_LOAD, kind.loaded), (WRAPPED, kind.banded)):
        if names & named(j.friction):
            return CONTACTS.get(element)
    return CONTACTS.get(element_of(kind.friction, kind.freely_rubbed, named(j.friction)))


def is_constant(element: ContactElement) -> bool:
    """Whether the friction of an element is constant at any load."""
    return element.name in CONSTANT.values()


def defaults_to_one(element: ContactElement | None, n: Number, law: str) -> bool:
    """Whether number n of a law defaults to 1. The default is 1 for friction without contacts: there, the coefficient scales the
    friction that other numbers give."""
    return element is not None and not element.count and element.scaled and n.name == LAWS[law].scale and n.unit == "1"
