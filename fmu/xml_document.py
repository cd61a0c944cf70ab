"""The bytes of XML documents."""

from __future__ import annotations

from xml.etree.ElementTree import Element, indent, tostring


def xml_bytes(root: Element) -> bytes:
    """An indented XML document in UTF-8."""
    indent(root, " ")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"


def with_prefix(root: Element, prefix: str) -> Element:
    """The document, with this prefix before each element name that has no prefix. Some readers of SSP files know elements only by
    their usual prefixes."""
    for e in root.iter():
        if ":" not in e.tag:
            e.tag = f"{prefix}:{e.tag}"
    return root
