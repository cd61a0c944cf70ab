"""Contact elements: where pin and bearing touch and how hard (paper §7). A new one is a new file and one registry line."""

from engine.contact.ball import BALL
from engine.contact.base import Contact, ContactElement, Wrench
from engine.contact.journal import JOURNAL, SHAFT
from engine.contact.sleeve import SLEEVE
from engine.contact.universal import UNIVERSAL

REGISTRY: dict[str, ContactElement] = {e.name: e for e in (JOURNAL, SHAFT, BALL, UNIVERSAL, SLEEVE)}

__all__ = ["REGISTRY", "Contact", "ContactElement", "Wrench"]
