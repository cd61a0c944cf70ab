"""Contact elements: contact points and contact forces between pin and bearing (paper §7). A new element needs a new file and a line
in the registry."""

from trunnion.elements.contact.contact_element import Contact, ContactElement, Place, Size, Solid, Wrench
from trunnion.elements.contact.registry import GIVEN, REGISTRY, element_of, sizes

__all__ = ["GIVEN", "REGISTRY", "Contact", "ContactElement", "Place", "Size", "Solid", "Wrench", "element_of", "sizes"]
