"""Contact elements: where pin and bearing touch and how hard (paper §7). A new one is a new file and one registry line."""

from engine.contact.base import Contact, ContactElement, Place, Size, Solid, Wrench
from engine.contact.registry import REGISTRY, sizes

__all__ = ["REGISTRY", "Contact", "ContactElement", "Place", "Size", "Solid", "Wrench", "sizes"]
