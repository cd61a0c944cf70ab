"""SSV 1.0 files (System Structure and Parameterization), which hold parameter values with their units by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

from trunnion.fmu.variables.outputs_inputs_parameters import Variable
from trunnion.fmu.variables.variable_types import ENUMERATIONS
from trunnion.fmu.xml_document import with_prefix, xml_bytes
from trunnion.scene.units.unit_parser import parse_unit

SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
TYPE = "application/x-ssp-parameter-set"
BaseUnits = Mapping[str, str]
"""Attributes of the element BaseUnit: exponents of base units, factor and offset."""


@dataclass(frozen=True)
class ParameterValue:
    """A value of a parameter. type: "Real", "Integer", "Boolean" or "String". value: the value as text. unit: the unit of a real
    parameter, else ""."""

    name: str
    type: str
    value: str
    unit: str = ""


def of_scene(listed: Iterable[Variable]) -> list[ParameterValue]:
    """The parameters of an FMU with their exported values. The list omits enumerations, which are settings of the solver."""
    out = []
    for v in listed:
        if v.causality == "parameter" and v.type not in ENUMERATIONS:
            whole = v.type != ""
            start = v.start or 0.0
            out.append(
                ParameterValue(v.name, "Integer", str(int(start))) if whole else ParameterValue(v.name, "Real", repr(start), v.unit)
            )
    return out


def base_of(unit: str) -> dict[str, str]:
    """The exponents of the SI base units in a unit of Trunnion."""
    dimension = parse_unit("" if unit == "1" else unit).dimension
    return {k: str(e) for k, e in zip(("kg", "m", "s", "rad"), dimension, strict=False) if e}


def add_units(parent: Element, units: Mapping[str, BaseUnits]) -> None:
    """Write the element Units. units: attributes of BaseUnit by unit name."""
    node = SubElement(parent, "Units")
    for name, base in sorted(units.items()):
        SubElement(SubElement(node, "ssc:Unit", {"name": name}), "ssc:BaseUnit", dict(base))


def parameter_set(name: str, values: Sequence[ParameterValue], units: Mapping[str, BaseUnits] | None = None) -> bytes:
    """The SSV file as bytes. units: BaseUnit attributes by unit name; None if all units are units of Trunnion."""
    root = Element("ParameterSet", {"xmlns:ssv": SSV, "xmlns:ssc": SSC, "version": "1.0", "name": name})
    parent = SubElement(root, "Parameters")
    for v in values:
        given = {"value": v.value} | ({"unit": v.unit} if v.unit else {})
        SubElement(SubElement(parent, "Parameter", {"name": v.name}), v.type, given)
    used = sorted({v.unit for v in values if v.unit})
    if used:
        add_units(root, {u: base_of(u) if units is None else units[u] for u in used})
    return xml_bytes(with_prefix(root, "ssv"))
