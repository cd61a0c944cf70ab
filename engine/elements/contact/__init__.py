"""Contact elements: where pin and bearing touch and how hard (paper §7). A new one is a new file and one registry line."""

from trunnion.elements.contact.contact_element import Contact, ContactElement, Place, Size, Solid, Wrench
from trunnion.elements.contact.registry import GIVEN, REGISTRY, element_of, sizes

__all__ = ["GIVEN", "REGISTRY", "Contact", "ContactElement", "Place", "Size", "Solid", "Wrench", "element_of", "sizes"]
