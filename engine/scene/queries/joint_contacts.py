"""How a joint of a scene rubs: the contact element of its type, or friction that does not follow the load."""

from __future__ import annotations

from dataclasses import fields

from trunnion.basics.number_declarations import Number
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact import ContactElement, element_of
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.joints import Friction, Joint


def named(f: Friction) -> set[str]:
    """The numbers that a joint's friction gives."""
    return {x.name for x in fields(f) if getattr(f, x.name) is not None}


def sizes_given(f: Friction, element: ContactElement) -> dict[str, float]:
    """Sizes of an element that a joint's friction gives, by label, m (one number may stand for several); without those that follow
    time or an input."""
    out: dict[str, float] = {}
    for s in element.sizes:
        value = getattr(f, s.name)
        if value is not None:
            values = value if isinstance(value, tuple) else (value,) * s.count
            out |= {label: float(v) for label, v in zip(s.labels, values, strict=True) if isinstance(v, float | int)}
    return out


def touching(j: Joint) -> ContactElement | None:
    """The contact element of a joint with friction; None where its type has none of the kind."""
    assert j.friction is not None
    kind = REGISTRY[j.type]
    return CONTACTS.get(element_of(kind.friction, kind.freely_rubbed, named(j.friction)))


def given(element: ContactElement | None, n: Number, law: str) -> bool:
    """Whether a number of a law is 1 where a joint says none: the ratio of friction that is itself given."""
    return element is not None and not element.count and n.name == LAWS[law].scale and n.unit == "1"
