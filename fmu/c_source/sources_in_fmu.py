"""The C sources inside an FMU, and their lists in ``modelDescription.xml`` or ``buildDescription.xml``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, fromstring

from trunnion.fmu.c_source.layout_sizes import sizes_of
from trunnion.fmu.c_source.source_files import texts
from trunnion.fmu.xml_document import xml_bytes

if TYPE_CHECKING:
    from trunnion.fmu.scene_export import Made

INTERFACES = ("ModelExchange", "CoSimulation")


def with_sources(documents: Mapping[str, bytes], made: Made) -> dict[str, bytes]:
    """The documents of an FMU and its C sources. The sources are listed in the file that the standard requires."""
    files = texts(made.sources, sizes_of(made.sources, made.model), made.standard, made.identifier)
    out = dict(documents) | {f"sources/{name}": text.encode() for name, text in files.items()}
    if made.standard == "3.0":
        out["sources/buildDescription.xml"] = build_description(made.identifier, list(files))
    else:
        out["modelDescription.xml"] = listing_sources(documents["modelDescription.xml"], list(files))
    return out


def listing_sources(description: bytes, files: Sequence[str]) -> bytes:
    """``modelDescription.xml`` of FMI 2.0 with the list of the C files to compile added."""
    root = fromstring(description)
    for interface in [e for e in root if e.tag in INTERFACES]:
        named = Element("SourceFiles")
        for file in files:
            SubElement(named, "File", {"name": file})
        interface.insert(0, named)
    return xml_bytes(root)


def build_description(identifier: str, files: Sequence[str]) -> bytes:
    """``buildDescription.xml`` of FMI 3.0."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    how = SubElement(root, "BuildConfiguration", {"modelIdentifier": identifier})
    together = SubElement(how, "SourceFileSet", {"language": "C99"})
    for file in files:
        SubElement(together, "SourceFile", {"name": file})
    alone = {"name": "FMI3_OVERRIDE_FUNCTION_PREFIX", "value": "1", "optional": "true"}
    SubElement(together, "PreprocessorDefinition", alone | {"description": "for a shared library: names without a prefix"})
    SubElement(how, "Library", {"name": "m", "external": "false"})
    return xml_bytes(root)
