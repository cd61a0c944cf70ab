"""Reader and writer of a system's parameters and of their mapping to variables of components. The module reads SSV and SSM files
(SSP 1.0) or the system's YAML file, and writes SSV and SSM files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar
from xml.etree.ElementTree import Element, SubElement

from trunnion.basics.name_patterns import suggestion
from trunnion.fmu.model_description.parameter_set_ssv import SSC, SSV, BaseUnits, ParameterValue, base_of, parameter_set
from trunnion.fmu.ssp.system_yaml import Component, Link, Setting, System
from trunnion.fmu.xml_document import with_prefix, xml_bytes
from trunnion.scene.findings.findings_and_paths import Finding, error_of
from trunnion.scene.units.numbers_with_units import Quantity, number
from trunnion.scene.units.unit_parser import UnitError, parse, parse_unit

MAPPING_TYPE = "application/x-ssp-parameter-mapping"
SYSTEM_VALUES, MAPPING = "resources/system_parameters.ssv", "resources/parameter_mapping.ssm"
SSM = "http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
SSV_SPACE, SSC_SPACE = f"{{{SSV}}}", f"{{{SSC}}}"
BASE = ("kg", "m", "s", "rad")
X = TypeVar("X")


@dataclass(frozen=True)
class MappedSystem:
    """A system whose components have the values of its parameters. files: the SSV and the SSM file of these parameters, by path in
    the SSP file. unused: parameters that no variable takes."""

    system: System
    mistakes: list[Finding]
    files: dict[str, bytes]
    unused: tuple[str, ...]


def with_mapped_values(system: System) -> MappedSystem:
    """The system with the values of its parameters as settings of its components. A parameter without a mapping sets the variable
    of the same name, COMPONENT.VARIABLE. Raises SceneError for files that cannot be read."""
    mistakes: list[Finding] = []
    parameters = _read_or(system.parameters, read_values, {}, ("parameters",), mistakes)
    links = _read_or(system.mappings, read_links, [], ("mappings",), mistakes)
    if mistakes:
        raise error_of(mistakes, system.lines, system.file)
    files = _files(system, parameters, links)
    mapped = {link.start for link in links}
    own = [Link(n, (c, rest), ("parameters", n)) for n in parameters for c, _, rest in [n.partition(".")] if n not in mapped]
    components = dict(system.components)
    for link in [*links, *(x for x in own if x.end[0] in components)]:
        name, variable = link.end
        known = components.get(name)
        if link.start not in parameters:
            mistakes.append(Finding(link.place, f"there is no parameter {link.start}", suggestion(link.start, parameters)))
        elif known is None:
            mistakes.append(Finding(link.place, f"there is no component {name}", f"one of {', '.join(components)}"))
        elif variable in known.parameters:
            mistakes.append(Finding(link.place, f"{name}.{variable} has two values", "remove one"))
        else:
            setting = Setting(parameters[link.start], link.factor, link.offset, link.place)
            components[name] = replace(known, parameters={**known.parameters, variable: setting})
    unused = tuple(x.start for x in own if x.end[0] not in components)
    return MappedSystem(replace(system, components=components), mistakes, files, unused)


def _read_or(given: X | Path, read: Callable[[Path], X], otherwise: X, place: tuple[str], mistakes: list[Finding]) -> X:
    """The given contents, or the contents of the given file. If the file cannot be read, the result is ``otherwise``."""
    if not isinstance(given, Path):
        return given
    try:
        return read(given)
    except ValueError as e:
        mistakes.append(Finding(place, str(e), getattr(e, "hint", "")))
        return otherwise


def _files(system: System, parameters: Mapping[str, Any], links: Sequence[Link]) -> dict[str, bytes]:
    """The SSV and SSM files of the system's parameters, by path in the SSP file. Files that the system names are copied."""
    if not parameters:
        return {}
    own, maps = system.parameters, system.mappings
    values = own.read_bytes() if isinstance(own, Path) else parameter_set("parameters", *written_values(parameters))
    return {SYSTEM_VALUES: values} | ({MAPPING: maps.read_bytes() if isinstance(maps, Path) else mapping(links)} if links else {})


def read_values(file: Path) -> dict[str, Any]:
    """The values in an SSV file, by name. A number with a unit becomes a quantity. Raises ValueError for a file that does not
    follow the schema, and UnitError for an unknown unit."""
    root = _read(file, "SystemStructureParameterValues.xsd")
    bases = {u.get("name"): dict(u.find(f"{SSC_SPACE}BaseUnit").attrib) for u in root.iter(f"{SSC_SPACE}Unit")}
    return {p.get("name"): _value(p[0], bases) for p in root.iter(f"{SSV_SPACE}Parameter")}


def _value(given: Any, bases: Mapping[str, Mapping[str, str]]) -> Any:
    """The value of a parameter. given: its element with type, value and unit."""
    kind, text, unit = given.tag.removeprefix(SSV_SPACE), given.get("value"), given.get("unit") or ""
    if kind not in ("Real", "Integer"):
        return text in ("true", "1") if kind == "Boolean" else text
    if not unit or unit == "1":
        return float(text)
    base = {k: float(x) for k, x in bases.get(unit, {}).items()}
    if not base:
        return number(f"{text} {unit}")
    strange = [k for k in base if k not in (*BASE, "factor", "offset")]
    if strange:
        raise UnitError(f"{given.getparent().get('name')}: the unit {unit} has the base unit {strange[0]}, which mechanisms lack")
    value = float(text) * base.get("factor", 1.0) + base.get("offset", 0.0)
    kg, m, s, rad = (int(base.get(k, 0)) for k in BASE)
    return Quantity(value, (kg, m, s, rad, 0), f"{text} {unit}")


def read_links(file: Path) -> list[Link]:
    """The entries of an SSM file. Raises ValueError for a file that does not follow the schema or has other transformations."""
    out = []
    for entry in _read(file, "SystemStructureParameterMapping.xsd"):
        source, (name, _, variable) = entry.get("source"), str(entry.get("target")).partition(".")
        kinds = [child.tag.removeprefix(SSC_SPACE) for child in entry]
        other = [k for k in kinds if k not in ("LinearTransformation", "Annotations")]
        if other:
            raise ValueError(f"the entry of {source} has a {other[0]}; only a LinearTransformation can be applied")
        if entry.get("suppressUnitConversion") in ("true", "1"):
            raise ValueError(f"the entry of {source} suppresses the conversion of units; give the value in the unit of its target")
        scale = {k: float(x) for t in entry.iter(f"{SSC_SPACE}LinearTransformation") for k, x in t.attrib.items()}
        out.append(Link(source, (name, variable), ("mappings",), **scale))
    return out


def _read(file: Path, schema: str) -> Any:
    """The root of an XML file that follows a schema of SSP 1.0."""
    from fmpy.ssp.ssd import validate_tree
    from lxml import etree

    try:
        root = etree.parse(str(file)).getroot()
        validate_tree(root, schema)
    except Exception as e:  # fmpy raises Exception, lxml its own errors
        raise ValueError(f"{file.name} cannot be read: {str(e).splitlines()[-1]}") from e
    return root


def written_values(parameters: Mapping[str, Any]) -> tuple[list[ParameterValue], dict[str, BaseUnits]]:
    """Values of a system's parameters as the SSV file writes them, and the base units of their units by name."""
    values: list[ParameterValue] = []
    units: dict[str, BaseUnits] = {}
    for name, value in parameters.items():
        if isinstance(value, bool):
            values.append(ParameterValue(name, "Boolean", str(value).lower()))
            continue
        try:
            x = number(value)
        except UnitError:
            values.append(ParameterValue(name, "String", str(value)))
            continue
        unit = parse(x.text)[2] if isinstance(x, Quantity) else ""
        factor = parse_unit(unit).factor
        values.append(ParameterValue(name, "Real", repr(float(x) / factor), unit))
        if unit:
            units[unit] = base_of(unit) | ({"factor": repr(factor)} if factor != 1.0 else {})
    return values, units


def mapping(links: Sequence[Link]) -> bytes:
    """The SSM file as bytes."""
    root = Element("ParameterMapping", {"xmlns:ssm": SSM, "xmlns:ssc": SSC, "version": "1.0"})
    for link in links:
        entry = SubElement(root, "MappingEntry", {"source": link.start, "target": ".".join(link.end)})
        if (link.factor, link.offset) != (1.0, 0.0):
            SubElement(entry, "ssc:LinearTransformation", {"factor": repr(link.factor), "offset": repr(link.offset)})
    return xml_bytes(with_prefix(root, "ssm"))


def numbers(component: Component) -> Iterator[tuple[str, float]]:
    """The settings of a scene that are numbers, in SI units. Wrong values are reported with their variables."""
    for name, s in component.parameters.items():
        try:
            yield name, s.factor * float(number(s.value)) + s.offset
        except UnitError:
            continue
