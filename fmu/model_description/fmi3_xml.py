"""``modelDescription.xml`` of FMI 3.0 from the list of variables."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element, SubElement

from trunnion.fmu.model_description.fmi2_xml import about, add_units, categories, depends_on, experiment, real
from trunnion.fmu.variables.exported_model import ExportedModel
from trunnion.fmu.variables.fmi3_arrays import ENUMERATION, FLOAT64, UINT64, Fmi3Variable
from trunnion.fmu.variables.fmi3_event_clocks import LAST, NAME
from trunnion.fmu.variables.model_exchange_states import does
from trunnion.fmu.variables.outputs_inputs_parameters import HUGE
from trunnion.fmu.variables.variable_types import ENUMERATIONS, QUANTITIES
from trunnion.fmu.xml_document import xml_bytes

STATES = ("canGetAndSetFMUState", "canSerializeFMUState")
SLOPES = ("providesDirectionalDerivatives", "providesAdjointDerivatives")
CAN = (
    "canHandleVariableCommunicationStepSize", *STATES, *SLOPES, "providesIntermediateUpdate", "mightReturnEarlyFromDoStep",
    "canReturnEarlyAfterIntermediateUpdate", "hasEventMode",
)  # fmt: skip
"""XML attributes of co-simulation that are true."""
CAN_EXCHANGE = (*STATES, *SLOPES, "needsCompletedIntegratorStep")
"""XML attributes of model exchange that are true."""
CANNOT = ("needsExecutionTool", "canBeInstantiatedOnlyOncePerProcess", "providesPerElementDependencies")
"""XML attributes that are false."""
TIME = "time"


def _own(made: ExportedModel) -> int:
    """The value reference of the time. The next references belong to the clocks, to the times of their ticks and to their
    counts."""
    return len(made.listed)


def _has_last_joint(made: ExportedModel) -> bool:
    """Whether a column identifies the joint of the last event."""
    return any(c.key == LAST for c in made.model.columns)


def _first_state(made: ExportedModel) -> int:
    """The value reference of the first state. The references of derivatives and event indicators come after the states."""
    return _own(made) + 1 + 3 * len(made.clocks) + int(_has_last_joint(made))


def model_description3(made: ExportedModel, token: str) -> bytes:
    """``modelDescription.xml`` as bytes."""
    scene, identifier = made.scene, made.identifier
    given_by = {"modelName": scene.name, "instantiationToken": token, **about(scene)}
    root = Element("fmiModelDescription", {"fmiVersion": "3.0", **given_by})
    flags = dict.fromkeys(CANNOT, "false")
    if does(made.kind, "me"):
        SubElement(root, "ModelExchange", {"modelIdentifier": identifier, **dict.fromkeys(CAN_EXCHANGE, "true"), **flags})
    if does(made.kind, "cs"):
        SubElement(root, "CoSimulation", {
            "modelIdentifier": identifier, "maxOutputDerivativeOrder": "1", **dict.fromkeys(CAN, "true"), **flags,
            "providesEvaluateDiscreteStates": "false"})  # fmt: skip
    scalars = [*(f.first for f in made.fmi3_variables), *made.exchanged.all]
    add_units(root, scalars, extra=("s",))
    _types(root, made)
    categories(root, "fmi3")
    experiment(root, scene, made.step)
    parent = SubElement(root, "ModelVariables")
    for f in made.fmi3_variables:
        _variable(parent, f, made)
    _own_variables(parent, made)
    _exchanged(parent, made)
    _structure(root, made)
    return xml_bytes(root)


def _types(root: Element, made: ExportedModel) -> None:
    """Write TypeDefinitions: quantities of real variables, names of enumeration values."""
    definitions = SubElement(root, "TypeDefinitions")
    scalars = [*(f.first for f in made.fmi3_variables), *made.exchanged.all]
    for unit in sorted({v.unit for v in scalars if not v.type and v.unit in QUANTITIES} | {"s"}):
        SubElement(definitions, "Float64Type", {"name": QUANTITIES[unit], "quantity": QUANTITIES[unit], "unit": unit})
    for name in sorted({v.type for v in scalars} & set(ENUMERATIONS)):
        node = SubElement(definitions, "EnumerationType", {"name": name})
        for value, (word, text) in ENUMERATIONS[name].items():
            SubElement(node, "Item", {"name": word, "value": str(value)} | ({"description": text} if text else {}))


def _variable(parent: Element, f: Fmi3Variable, made: ExportedModel) -> None:
    """Write a variable that exists in FMI 2.0, too."""
    v = f.first
    node = SubElement(parent, f.type, {
        "name": f.name, "valueReference": str(f.reference), "description": f.description, "causality": v.causality,
        "variability": v.variability,
    })  # fmt: skip
    if v.causality in ("input", "output") and v.variability == "continuous":
        node.set("intermediateUpdate", "true")
    node.attrib.update({"initial": v.initial} if v.initial else {})
    node.attrib.update(real(v) if f.type == FLOAT64 else _whole(f))
    node.attrib.pop("start", None)
    if v.start is not None:
        node.set("start", " ".join(_number(f, p.start) for p in f.parts))
    if (base := _rate_of(f, made)) is not None:
        node.set("derivative", str(base.reference))
    if len(f.parts) > 1:
        SubElement(node, "Dimension", {"start": str(len(f.parts))})


def _number(f: Fmi3Variable, x: float | None) -> str:
    return repr(float(x or 0.0)) if f.type == FLOAT64 else str(int(x or 0))


def _whole(f: Fmi3Variable) -> dict[str, str]:
    """XML attributes of an integer variable."""
    v = f.first
    if f.type == ENUMERATION:
        return {"declaredType": v.type}
    least = {"min": str(int(v.minimum))} if v.minimum > -HUGE and f.type == UINT64 else {}
    return least | ({"max": str(int(v.maximum))} if v.maximum < HUGE and f.type == UINT64 else {})


def _rate_of(f: Fmi3Variable, made: ExportedModel) -> Fmi3Variable | None:
    """The variable of which f is the time derivative, component by component; None if there is no such variable."""
    for other in made.fmi3_variables if f.first.rate_of else ():
        if [p.rate_of for p in f.parts] == [p.name for p in other.parts]:
            return other
    return None


def _own_variables(parent: Element, made: ExportedModel) -> None:
    """Write the variables that FMI 2.0 lacks: time, clocks with times and counts, the joint of the last event."""
    at, n = _own(made), len(made.clocks)
    SubElement(parent, FLOAT64, {
        "name": TIME, "valueReference": str(at), "description": "time", "causality": "independent", "variability": "continuous",
        "declaredType": QUANTITIES["s"], "unit": "s"})  # fmt: skip
    for i, c in enumerate(made.clocks):
        SubElement(parent, "Clock", {
            "name": c.name, "valueReference": str(at + 1 + i), "description": c.description, "causality": "output",
            "variability": "discrete", "intervalVariability": "triggered"})  # fmt: skip
    for k, (name, kind, text) in enumerate(
        (("time", FLOAT64, "time of the last of these events, s"), ("count", UINT64, "number of these events so far"))
    ):
        for i, c in enumerate(made.clocks):
            node = SubElement(parent, kind, {
                "name": f"{c.name}.{name}", "valueReference": str(at + 1 + n * (1 + k) + i),
                "description": f"{c.description}: {text}", "causality": "output",
                "variability": "discrete", "clocks": str(at + 1 + i), "initial": "calculated"})  # fmt: skip
            if kind == FLOAT64:
                node.attrib.update({"declaredType": QUANTITIES["s"], "unit": "s"})
    if _has_last_joint(made):
        SubElement(parent, "String", {
            "name": NAME, "valueReference": str(at + 1 + 3 * n), "description": "joint of the last event", "causality": "local",
            "variability": "discrete", "initial": "calculated"})  # fmt: skip


def _exchanged(parent: Element, made: ExportedModel) -> None:
    """Write the states, their derivatives and the event indicators."""
    at = {v.name: _first_state(made) + i for i, v in enumerate(made.exchanged.all)}
    for v in made.exchanged.all:
        node = SubElement(parent, FLOAT64, {
            "name": v.name, "valueReference": str(at[v.name]), "description": v.description, "causality": v.causality,
            "variability": v.variability, "initial": v.initial, **real(v)})  # fmt: skip
        if v.rate_of:
            node.set("derivative", str(at[v.rate_of]))


def _structure(root: Element, made: ExportedModel) -> None:
    """Write ModelStructure: the outputs with their dependencies during the run and at the start, derivatives, event indicators.
    Derivatives depend on all inputs and states. The element lists all inputs and states, because some importers require a complete
    list. As in the other elements, time is not listed."""
    structure = SubElement(root, "ModelStructure")
    place = {f.reference + i + 1: f.reference for f in made.fmi3_variables for i in range(len(f.parts))}
    outputs = [f for f in made.fmi3_variables if f.first.causality == "output"]
    first, n = _first_state(made), len(made.exchanged.states)
    states, rates = range(first, first + n), range(first + n, first + 2 * n)
    told = range(first + 2 * n, first + len(made.exchanged.all))
    parameters, inputs = ([f.reference for f in made.fmi3_variables if f.first.causality == c] for c in ("parameter", "input"))
    for name in ("Output", "InitialUnknown"):
        for f in outputs:
            found = {place[p] for p in _of_parts(f, made, name == "Output")}
            found |= set(states) if name == "Output" and f.first.variability == "continuous" else set()
            SubElement(structure, name, {"valueReference": str(f.reference)} | depends_on(sorted(found)))
        for i in range((3 if name == "Output" else 1) * len(made.clocks)):
            SubElement(structure, name, {"valueReference": str(_own(made) + 1 + i)} | depends_on(()))
        for i in states if name == "InitialUnknown" else ():
            SubElement(structure, name, {"valueReference": str(i)} | depends_on(parameters))
        kind, known = ("ContinuousStateDerivative", states) if name == "Output" else (name, parameters)
        for i in rates:
            SubElement(structure, kind, {"valueReference": str(i)} | depends_on(sorted([*inputs, *known])))
    for i in told:
        SubElement(structure, "EventIndicator", {"valueReference": str(i)})


def _of_parts(f: Fmi3Variable, made: ExportedModel, now: bool) -> Iterator[int]:
    """Positions of the variables on which the components of an output depend. now: True for the dependencies during the run, False
    for those at the start."""
    for i in range(len(f.parts)):
        d = made.depends[f.reference + i]
        yield from d.now if now else d.start
