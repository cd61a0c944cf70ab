"""``modelDescription.xml`` from the list of variables."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from engine.basics.version import version
from engine.scene.model import Scene
from engine.scene.units import parse_unit
from fmu.description import HUGE, Variable

DISPLAY = {
    "rad": (("deg", 57.29577951308232),),
    "rad/s": (("deg/s", 57.29577951308232), ("rpm", 9.549296585513721)),
    "rad/s^2": (("deg/s^2", 57.29577951308232),),
    "m": (("mm", 1e3),),
    "N": (("kN", 1e-3),),
}
"""Display units: value shown = factor · SI value; the first one is asked for where it is an angle."""
CATEGORIES = {
    "logAll": "All messages.",
    "logStatusWarning": "Messages with fmi2Warning status.",
    "logStatusDiscard": "Messages with fmi2Discard status: a step or a run that cannot go on, and why.",
    "logStatusError": "Messages with fmi2Error status.",
    "logStatusFatal": "Messages with fmi2Fatal status.",
}


def date() -> str:
    """The date of generation: that of SOURCE_DATE_EPOCH, or a constant, so that a scene gives the same bytes on any day."""
    at = datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "946684800")), UTC)
    return at.strftime("%Y-%m-%dT%H:%M:%SZ")


def model_description(scene: Scene, listed: list[Variable], identifier: str, guid: str, step: float, flavour: str) -> bytes:
    """``modelDescription.xml`` as bytes."""
    root = Element("fmiModelDescription", {
        "fmiVersion": "2.0", "modelName": scene.name, "guid": guid, "description": scene.title or f"Mechanism {scene.name}",
        "author": "Trunnion", "version": version(), "copyright": "The scene: its author. The runtime: the Trunnion authors",
        "license": "Apache-2.0 (runtime; see documentation/licenses)", "generationTool": f"Trunnion {version()}",
        "generationDateAndTime": date(), "variableNamingConvention": "structured",
    })  # fmt: skip
    options = {
        "modelIdentifier": identifier, "needsExecutionTool": "false", "canHandleVariableCommunicationStepSize": "true",
        "canBeInstantiatedOnlyOncePerProcess": "false", "canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true",
    }
    if flavour == "native":
        options |= {"canInterpolateInputs": "true", "maxOutputDerivativeOrder": "0", "providesDirectionalDerivative": "true",
                    "canNotUseMemoryManagementFunctions": "false"}
    else:
        options |= {"canNotUseMemoryManagementFunctions": "true"}
    SubElement(root, "CoSimulation", options)
    _units(root, listed)
    categories = SubElement(root, "LogCategories")
    for name, text in CATEGORIES.items():
        SubElement(categories, "Category", {"name": name, "description": text})
    sim = scene.simulation
    SubElement(root, "DefaultExperiment", {
        "startTime": "0", "stopTime": repr(float(sim.until)), "tolerance": repr(float(sim.rtol)), "stepSize": repr(step)})
    _variables(root, listed)
    _structure(root, listed)
    indent(root, " ")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"


def _units(root: Element, listed: list[Variable]) -> None:
    units = SubElement(root, "UnitDefinitions")
    for unit in sorted({v.unit for v in listed}):
        node = SubElement(units, "Unit", {"name": unit})
        dimension = parse_unit("" if unit == "1" else unit).dimension
        exponents = dict(zip(("kg", "m", "s", "rad"), dimension, strict=False))
        SubElement(node, "BaseUnit", {k: str(e) for k, e in exponents.items() if e})
        for name, factor in DISPLAY.get(unit, ()):
            SubElement(node, "DisplayUnit", {"name": name, "factor": repr(factor)})


def _variables(root: Element, listed: list[Variable]) -> None:
    parent = SubElement(root, "ModelVariables")
    for reference, v in enumerate(listed):
        given = {"name": v.name, "valueReference": str(reference), "description": v.description, "causality": v.causality,
                 "variability": v.variability}
        if v.initial:
            given["initial"] = v.initial
        node = SubElement(parent, "ScalarVariable", given)
        real = {"unit": v.unit}
        if v.unit in DISPLAY and "rad" in v.unit:
            real["displayUnit"] = DISPLAY[v.unit][0][0]
        if v.minimum > -HUGE:
            real["min"] = repr(v.minimum)
        if v.maximum < HUGE:
            real["max"] = repr(v.maximum)
        if v.nominal != 1.0:
            real["nominal"] = repr(v.nominal)
        if v.start is not None:
            real["start"] = repr(v.start)
        SubElement(node, "Real", real)


def _structure(root: Element, listed: list[Variable]) -> None:
    """Write ModelStructure: an output depends on inputs at once where forces act on it; at the start all outputs depend on
    everything that was set before."""
    structure = SubElement(root, "ModelStructure")
    inputs = [str(i + 1) for i, v in enumerate(listed) if v.causality == "input"]
    outputs = [(i + 1, v) for i, v in enumerate(listed) if v.causality == "output"]
    node = SubElement(structure, "Outputs")
    for index, v in outputs:
        SubElement(node, "Unknown", {"index": str(index), "dependencies": " ".join(inputs) if v.direct else ""})
    node = SubElement(structure, "InitialUnknowns")
    for index, _ in outputs:
        SubElement(node, "Unknown", {"index": str(index)})
