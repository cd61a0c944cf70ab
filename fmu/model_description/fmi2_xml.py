"""``modelDescription.xml`` of FMI 2.0."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from xml.etree.ElementTree import Element, SubElement

from trunnion.basics.version import version
from trunnion.fmu.model_description.parameter_set_ssv import base_of
from trunnion.fmu.variables.exported_model import ExportedModel
from trunnion.fmu.variables.model_exchange_states import does
from trunnion.fmu.variables.outputs_inputs_parameters import HUGE, Variable
from trunnion.fmu.variables.variable_types import ENUMERATIONS, QUANTITIES
from trunnion.fmu.xml_document import xml_bytes
from trunnion.scene.data_classes.scene import Scene

DISPLAY = {
    "rad": (("deg", 57.29577951308232),),
    "rad/s": (("deg/s", 57.29577951308232), ("rpm", 9.549296585513721)),
    "rad/s^2": (("deg/s^2", 57.29577951308232),),
    "m": (("mm", 1e3),),
    "N": (("kN", 1e-3),),
}
"""Display units by SI unit: displayed value = factor · SI value. For angles, the first display unit is the default."""
CATEGORIES = {
    "logAll": "All messages.",
    "logStatusWarning": "Messages with {fmi}Warning status.",
    "logStatusDiscard": "Messages with {fmi}Discard status: a step or a run that cannot continue, with the reason.",
    "logStatusError": "Messages with {fmi}Error status.",
    "logStatusFatal": "Messages with {fmi}Fatal status.",
    "logEvents": "Events with their times: stick, slip, reversal, separation, impact, end stops.",
    "logProgress": "Start, progress and end of the run.",
}


def date(scene: Scene) -> str:
    """The generation date: SOURCE_DATE_EPOCH if this variable is set, else the scene's date, else a constant. The date never is the
    time of the export, so that repeated exports give equal files."""
    if scene.date and "SOURCE_DATE_EPOCH" not in os.environ:
        return f"{scene.date}T00:00:00Z"
    at = datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "946684800")), UTC)
    return at.strftime("%Y-%m-%dT%H:%M:%SZ")


def model_description(made: ExportedModel, guid: str, flavour: str) -> bytes:
    scene = made.scene
    root = Element("fmiModelDescription", {"fmiVersion": "2.0", "modelName": scene.name, "guid": guid, **about(scene)})
    everywhere = {
        "modelIdentifier": made.identifier, "needsExecutionTool": "false", "canBeInstantiatedOnlyOncePerProcess": "false",
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true",
    }  # fmt: skip
    if does(made.kind, "me"):
        root.set("numberOfEventIndicators", str(len(made.exchanged.indicators)))
        SubElement(root, "ModelExchange", {**everywhere, "completedIntegratorStepNotNeeded": "false",
                                           "providesDirectionalDerivative": "true"})  # fmt: skip
    if does(made.kind, "cs"):
        SubElement(root, "CoSimulation", {
            **everywhere, "canHandleVariableCommunicationStepSize": "true", "canInterpolateInputs": "true",
            "maxOutputDerivativeOrder": "1", "providesDirectionalDerivative": "true"})  # fmt: skip
    add_units(root, made.scalars, bases=made.bases)
    _types(root, made.scalars)
    categories(root, "fmi2")
    experiment(root, scene, made.step)
    _variables(root, made.scalars)
    _structure(root, made)
    return xml_bytes(root)


def about(scene: Scene) -> dict[str, str]:
    """XML attributes of the model that both FMI versions have."""
    return {
        "description": scene.title or f"Mechanism {scene.name}",
        "author": scene.author or "Trunnion", "version": scene.version or version(),
        "copyright": "The scene: its author. The runtime: the Trunnion authors",
        "license": "Apache-2.0 (runtime; see documentation/licenses)", "generationTool": f"Trunnion {version()}",
        "generationDateAndTime": date(scene), "variableNamingConvention": "structured",
    }  # fmt: skip


def categories(root: Element, fmi: str) -> None:
    """Write LogCategories. fmi: prefix of the standard's names."""
    parent = SubElement(root, "LogCategories")
    for name, text in CATEGORIES.items():
        SubElement(parent, "Category", {"name": name, "description": text.format(fmi=fmi)})


def experiment(root: Element, scene: Scene, step: float) -> None:
    """Write DefaultExperiment."""
    sim = scene.simulation
    SubElement(root, "DefaultExperiment", {
        "startTime": "0", "stopTime": repr(float(sim.until)), "tolerance": repr(float(sim.rtol)), "stepSize": repr(step)})


def add_units(
    root: Element, listed: list[Variable], extra: tuple[str, ...] = (), bases: Mapping[str, Mapping[str, str]] | None = None
) -> None:
    """Write UnitDefinitions. extra: further units. bases: by unit, the attributes of its base unit if Trunnion does not know the
    unit."""
    units = SubElement(root, "UnitDefinitions")
    for unit in sorted({v.unit for v in listed if not v.type} | set(extra)):
        node = SubElement(units, "Unit", {"name": unit})
        SubElement(node, "BaseUnit", dict((bases or {}).get(unit) or base_of(unit)))
        for name, factor in DISPLAY.get(unit, ()):
            SubElement(node, "DisplayUnit", {"name": name, "factor": repr(factor)})


def _types(root: Element, listed: list[Variable]) -> None:
    """Write TypeDefinitions: quantities of real variables, names of enumeration values."""
    definitions = SubElement(root, "TypeDefinitions")
    for unit in sorted({v.unit for v in listed if not v.type and v.unit in QUANTITIES}):
        node = SubElement(definitions, "SimpleType", {"name": QUANTITIES[unit]})
        SubElement(node, "Real", {"quantity": QUANTITIES[unit], "unit": unit})
    for name in sorted({v.type for v in listed} & set(ENUMERATIONS)):
        node = SubElement(SubElement(definitions, "SimpleType", {"name": name}), "Enumeration")
        for value, (word, text) in ENUMERATIONS[name].items():
            SubElement(node, "Item", {"name": word, "value": str(value)} | ({"description": text} if text else {}))


def _variables(root: Element, listed: list[Variable]) -> None:
    parent = SubElement(root, "ModelVariables")
    place = {v.name: i + 1 for i, v in enumerate(listed)}
    for reference, v in enumerate(listed):
        given = {"name": v.name, "valueReference": str(reference), "description": v.description, "causality": v.causality,
                 "variability": v.variability}
        if v.initial:
            given["initial"] = v.initial
        node = SubElement(parent, "ScalarVariable", given)
        if v.type:
            _whole(node, v)
        else:
            SubElement(node, "Real", real(v) | ({"derivative": str(place[v.rate_of])} if v.rate_of else {}))


def _whole(node: Element, v: Variable) -> None:
    """Write the type of an integer variable."""
    given = {"declaredType": v.type} if v.type in ENUMERATIONS else {}
    if v.type not in ENUMERATIONS and v.minimum > -HUGE:
        given["min"] = str(int(v.minimum))
    if v.type not in ENUMERATIONS and v.maximum < HUGE:
        given["max"] = str(int(v.maximum))
    if v.start is not None:
        given["start"] = str(int(v.start))
    SubElement(node, "Enumeration" if v.type in ENUMERATIONS else v.type, given)


def real(v: Variable) -> dict[str, str]:
    """Attributes of a real variable."""
    real = {"declaredType": QUANTITIES[v.unit]} if v.unit in QUANTITIES else {}
    real["unit"] = v.unit
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
    return real


def _structure(root: Element, made: ExportedModel) -> None:
    """Write ModelStructure: the outputs with their dependencies during the run and at the start, and the derivatives of states.
    Derivatives of states depend on all known variables."""
    structure, first, n = SubElement(root, "ModelStructure"), len(made.listed) + 1, len(made.exchanged.states)
    outputs = [(i, v, d) for i, (v, d) in enumerate(zip(made.listed, made.depends, strict=False)) if v.causality == "output"]
    states, rates = range(first, first + n), range(first + n, first + 2 * n)
    node = SubElement(structure, "Outputs")
    for i, v, d in outputs:
        _unknown(node, i + 1, (*d.now, *(states if v.variability == "continuous" else ())))
    node = SubElement(structure, "Derivatives") if n else structure
    for i in rates:
        _unknown(node, i, None)
    node = SubElement(structure, "InitialUnknowns")
    for i, _, d in outputs:
        _unknown(node, i + 1, d.start)
    parameters = tuple(i + 1 for i, v in enumerate(made.listed) if v.causality == "parameter")
    for i in states:
        _unknown(node, i, parameters)
    for i in rates:
        _unknown(node, i, None)


def _unknown(node: Element, index: int, places: tuple[int, ...] | None) -> None:
    """Write an unknown with its dependencies. places: indices of the variables on which the unknown depends; None means all known
    variables."""
    SubElement(node, "Unknown", {"index": str(index), **({} if places is None else depends_on(places))})


def depends_on(places: Iterable[int]) -> dict[str, str]:
    """XML attributes that list the dependencies of an unknown."""
    found = list(places)
    return {"dependencies": " ".join(map(str, found)), "dependenciesKind": " ".join(["dependent"] * len(found))}
