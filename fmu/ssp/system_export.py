"""Export of a system of FMUs as an SSP 1.0 file, which contains the FMUs, their connections and the values of their parameters."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar
from xml.etree.ElementTree import Element, SubElement

from trunnion.basics.atomic_files import destination_problems
from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.name_patterns import suggestion
from trunnion.fmu import zip_archive
from trunnion.fmu.model_description.parameter_set_ssv import SSC, TYPE, BaseUnits, ParameterValue, add_units, parameter_set
from trunnion.fmu.ssp.connection_arithmetic import computed_by_components
from trunnion.fmu.ssp.parameter_mapping import MAPPING, MAPPING_TYPE, numbers, with_mapped_values
from trunnion.fmu.ssp.system_yaml import Component, Connection, Setting, System, load_system
from trunnion.fmu.variables.input_sums import Source, Sums
from trunnion.fmu.xml_document import with_prefix, xml_bytes
from trunnion.scene import load_scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.parameter_evaluation import NAMED
from trunnion.scene.findings.findings_and_paths import Finding, error_of
from trunnion.scene.units.numbers_with_units import Quantity, number
from trunnion.scene.units.unit_parser import UnitError, parse_unit

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
FILE, VALUES = "SystemStructure.ssd", "resources/parameters.ssv"
TYPES = {"Real": "Real", "Float64": "Real", "Integer": "Integer", "Int32": "Integer", "Boolean": "Boolean", "String": "String"}
"""Connector types by type of an FMU variable. Variables of other types have no connectors."""
SUMS = "remove one connection, or replace the FMU by its scene: only FMUs that are exported with the system can add several sources"
X = TypeVar("X")
Sources = Mapping[str, Mapping[str, Sequence[Source]]]
"""The sources of inputs that are sums, by component and input."""
SCALES = {"factor": 1.0, "offset": 0.0}
"""Default factor and offset of a unit relative to its base unit."""


@dataclass(frozen=True)
class Port:
    """A variable of an FMU. type: a value of ``TYPES``."""

    causality: str
    type: str
    unit: str


@dataclass(frozen=True)
class FmuComponent:
    """A component. data: bytes of its FMU. ports: its variables by name. units: attributes of the base unit, by unit name."""

    data: bytes
    ports: dict[str, Port]
    units: dict[str, dict[str, str]]


@dataclass(frozen=True)
class ExportedSystem:
    """The result of an export. bytes: size of the file. connections, parameters: their numbers. unused: parameters of the system
    that no variable takes."""

    file: Path
    bytes: int
    components: tuple[str, ...]
    connections: int
    parameters: int
    unused: tuple[str, ...]


def export_system(file: str | Path, target: str | Path, platform: Sequence[str] | str = "host") -> ExportedSystem:
    """Write the system of a YAML file as an SSP file. platform: platforms for which scenes are exported as FMUs. Raises SceneError
    with all problems."""
    wrong = destination_problems(str(target), (".ssp",), "-o")
    if not Path(file).is_file():
        wrong = [Problem("SYSTEM", f"there is no file {file}", "components: and connections: in a YAML file"), *wrong]
    raise_problems(wrong)
    mapped = with_mapped_values(load_system(Path(file)))
    system = mapped.system
    parts, sums, copied = _parts(system, platform)
    mistakes = [*mapped.mistakes, *_connected(system, parts), *_unique(system, sums)]
    system = replace(system, connections=copied)
    values = list(_values(system, parts, sums, mistakes))
    if mistakes:
        raise error_of(mistakes, system.lines, system.file)
    bound = [*[VALUES] * bool(values), *mapped.files]
    contents = {FILE: description(system, parts, bound)} | {f"resources/{n}.fmu": p.data for n, p in parts.items()} | mapped.files
    if values:
        contents[VALUES] = parameter_set(system.name, values, _units(parts))
    out = Path(target)
    zip_archive.write(out, contents)
    return ExportedSystem(out, out.stat().st_size, tuple(parts), len(system.connections), len(values), mapped.unused)


def _parts(system: System, platform: Sequence[str] | str) -> tuple[dict[str, FmuComponent], Sources, list[Connection]]:
    """The components by name, the inputs that components compute as sums, and the connections. Connections to such an input end at
    a source of its sum. Raises SceneError with the problems of all components."""
    problems: list[Problem] = []
    given = dict(_each(system, problems, lambda name, c: _existing(system, c) if c.fmu else _scene(system, c)))
    fmus = {n: p for n, p in given.items() if isinstance(p, FmuComponent)}
    scenes = {n: s for n, s in given.items() if not isinstance(s, FmuComponent)}
    units = {n: {v: (x.unit, p.units.get(x.unit, {})) for v, x in p.ports.items()} for n, p in fmus.items()}
    sums, copied = computed_by_components(system, {n: s.inputs for n, s in scenes.items()}, units)
    made = dict(_each(system, problems, lambda name, c: _exported(scenes[name], c, platform, sums.get(name, {})), scenes))
    raise_problems(problems)
    return {n: fmus.get(n) or made[n] for n in system.components}, sums, copied


def _each(
    system: System, problems: list[Problem], work: Callable[[str, Component], X], among: Collection[str] | None = None
) -> Iterator[tuple[str, X]]:
    """The result of ``work`` for each component. Problems are appended to ``problems``. among: names of the components; None means
    all components."""
    for name, c in system.components.items():
        try:
            if among is None or name in among:
                yield name, work(name, c)
        except SceneError as e:
            where = f"components.{name}"
            problems += [Problem(f"{where}: {p.where}", p.what, p.hint, p.file or system.file, p.line) for p in e.problems]


def _existing(system: System, c: Component) -> FmuComponent:
    """The component whose FMU the system names."""
    file = system.folder / c.fmu
    if not file.is_file():
        raise SceneError([Problem("fmu", f"there is no file {file}")])
    return _part(file.read_bytes())


def _scene(system: System, c: Component) -> Scene:
    """The scene of a component."""
    there = system.folder / c.scene
    return load_scene(there if there.exists() else c.scene)


def _exported(scene: Scene, c: Component, platform: Sequence[str] | str, sums: Sums) -> FmuComponent:
    """The component with the exported FMU of its scene. sums: inputs that are sums of sources. In the FMU, these inputs are local
    variables."""
    from trunnion.fmu.scene_export import export

    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "component.fmu"
        starts = dict(numbers(c))
        changed = {n: x for n, x in starts.items() if n.startswith(f"{NAMED}.")}
        changed |= {f"inputs.{n}.start": x for n, x in starts.items() if n in scene.inputs}
        chosen = c.outputs and list(c.outputs)
        export(scene, made, overrides={**c.changes, **changed}, outputs=chosen, platform=platform, starts=starts, sums=sums)
        part = _part(made.read_bytes())
        return replace(part, ports={n: replace(p, causality="input") if n in sums else p for n, p in part.ports.items()})


def _part(data: bytes) -> FmuComponent:
    """A component from its FMU."""
    import io

    from fmpy import read_model_description

    try:
        told = read_model_description(io.BytesIO(data), validate=False)
    except Exception as e:  # fmpy raises many kinds of errors for invalid files
        raise SceneError(
            [Problem("fmu", f"the FMU cannot be read: {str(e).splitlines()[0] if str(e) else type(e).__name__}")]
        ) from e
    if told.coSimulation is None:
        raise SceneError([Problem("fmu", "the FMU is not for co-simulation")])
    ports = {
        v.name: Port(v.causality, TYPES[v.type], v.unit or (v.declaredType.unit if v.declaredType else "") or "")
        for v in told.modelVariables if v.type in TYPES and not getattr(v, "dimensions", None)
    }  # fmt: skip
    return FmuComponent(data, ports, {u.name: _base(u.baseUnit) for u in told.unitDefinitions})


def _base(unit: object) -> dict[str, str]:
    """The attributes of a base unit that differ from the defaults. unit: a unit object from fmpy, or None if the unit is
    unknown."""
    powers = {k: getattr(unit, k, 0) or 0 for k in ("kg", "m", "s", "A", "K", "mol", "cd", "rad")}
    scales = {k: float(getattr(unit, k, usual) or usual) for k, usual in SCALES.items()}
    return {k: str(p) for k, p in powers.items() if p} | {k: repr(x) for k, x in scales.items() if x != SCALES[k]}


def _connected(system: System, parts: dict[str, FmuComponent]) -> Iterator[Finding]:
    """Problems of the connections."""
    for c in system.connections:
        ends = [_port(c, end, causality, parts) for end, causality in ((c.start, "output"), (c.end, "input"))]
        yield from (e for e in ends if isinstance(e, Finding))
        a, b = ends
        if not isinstance(a, Port) or not isinstance(b, Port):
            continue
        if a.type != b.type:
            yield Finding(c.place, f"{a.type} cannot be connected to {b.type}")
        base = [{k: e for k, e in p.units.get(x.unit, {}).items() if k not in ("factor", "offset", "rad")}
                for p, x in ((parts[c.start[0]], a), (parts[c.end[0]], b))]  # fmt: skip
        if a.unit and b.unit and base[0] != base[1]:
            yield Finding(c.place, f"{a.unit} cannot be connected to {b.unit}", "connect quantities of one kind")


def _port(c: Connection, end: tuple[str, str], causality: str, parts: dict[str, FmuComponent]) -> Port | Finding:
    """The variable at an end of a connection, or the problem with this end."""
    name, variable = end
    if name not in parts:
        return Finding(c.place, f"there is no component {name}", f"one of {', '.join(parts)}")
    port = parts[name].ports.get(variable)
    if port is None:
        known = [v for v, p in parts[name].ports.items() if p.causality == causality]
        hint = suggestion(variable, known, f"its {causality}s: {', '.join(known[:8]) or 'none'}")
        return Finding(c.place, f"{name} has no variable {variable}", hint)
    if port.causality != causality:
        hint = f"add this variable to outputs: of {name}" if causality == "output" and port.causality == "local" else ""
        return Finding(c.place, f"{variable} of {name} is not an {causality} (it is {port.causality})", hint)
    return port


def _unique(system: System, sums: Sources) -> Iterator[Finding]:
    """Problems of inputs that have more than one source and are not sums, and of repeated connections."""
    seen: set[tuple[str, str]] = set()
    pairs: set[tuple[tuple[str, str], tuple[str, str]]] = set()
    for c in system.connections:
        if (c.start, c.end) in pairs:
            yield Finding(c.place, f"{'.'.join(c.start)} and {'.'.join(c.end)} are connected twice", "remove one, or use a factor")
        elif c.end in seen and c.end[1] not in sums.get(c.end[0], ()):
            yield Finding(c.place, f"{'.'.join(c.end)} has two sources", SUMS)
        seen.add(c.end)
        pairs.add((c.start, c.end))


def _values(system: System, parts: dict[str, FmuComponent], sums: Sources, wrong: list[Finding]) -> Iterator[ParameterValue]:
    """The values of parameters. Problems are appended to ``wrong``."""
    for name, c in system.components.items():
        for variable, setting in c.parameters.items():
            port = parts[name].ports.get(variable)
            if port is None or port.causality not in ("parameter", "input") or variable in sums.get(name, ()):
                known = [v for v, p in parts[name].ports.items() if p.causality == "parameter"]
                wrong.append(Finding(setting.place, f"{name} has no parameter {variable}", suggestion(variable, known)))
                continue
            try:
                yield _given(f"{name}.{variable}", port, parts[name].units.get(port.unit, {}), setting)
            except UnitError as e:
                wrong.append(Finding(setting.place, e.what, e.hint))


def _given(name: str, port: Port, base: BaseUnits, setting: Setting) -> ParameterValue:
    """A value with the type and unit of its variable. base: base unit of the variable's unit. Raises UnitError for a wrong unit."""
    value = setting.value
    if port.type in ("String", "Boolean"):
        return ParameterValue(name, port.type, str(value).lower() if port.type == "Boolean" else str(value))
    x = number(value)
    if isinstance(x, Quantity):
        try:
            fits = x.fits(parse_unit("" if port.unit == "1" else port.unit).dimension)
        except UnitError:
            raise UnitError(f"its unit {port.unit} is unknown", "give the number alone") from None
        if not fits:
            raise UnitError(f"{x.text} is not a value in {port.unit or '1'}")
        x = (float(x) - float(base.get("offset", 0.0))) / float(base.get("factor", 1.0))
    x = setting.factor * float(x) + setting.offset
    if port.type == "Integer":
        return ParameterValue(name, "Integer", str(int(x)))
    return ParameterValue(name, "Real", repr(x), port.unit)


def _units(parts: dict[str, FmuComponent]) -> dict[str, dict[str, str]]:
    """The attributes of base units for the units of all components, by unit name."""
    return {u: base for p in parts.values() for u, base in p.units.items()}


def description(system: System, parts: dict[str, FmuComponent], bound: Sequence[str]) -> bytes:
    """The file ``SystemStructure.ssd`` as bytes. Its connectors are all outputs and the connected inputs of the components. bound:
    the files with values of parameters. Values of later files replace values of earlier files."""
    root = Element(
        "SystemStructureDescription",
        {"xmlns:ssd": SSD, "xmlns:ssc": SSC, "version": "1.0", "name": system.name, "generationTool": "Trunnion"},
    )
    top = SubElement(root, "System", {"name": system.name})
    bindings = SubElement(top, "ParameterBindings") if bound else top
    for file in bound:
        if file != MAPPING:
            binding = SubElement(bindings, "ParameterBinding", {"type": TYPE, "source": file})
        else:
            SubElement(binding, "ParameterMapping", {"type": MAPPING_TYPE, "source": file})
    elements, ends = SubElement(top, "Elements"), {c.end for c in system.connections}
    used: set[str] = set()
    for name, part in parts.items():
        node = SubElement(elements, "Component", {
            "name": name, "type": "application/x-fmu-sharedlibrary", "implementation": "CoSimulation",
            "source": f"resources/{name}.fmu"})  # fmt: skip
        ports = {v: p for v, p in part.ports.items() if p.causality == "output" or (name, v) in ends}
        parent = SubElement(node, "Connectors") if ports else node
        for variable, port in ports.items():
            connector = SubElement(parent, "Connector", {"name": variable, "kind": port.causality})
            has_unit = port.type == "Real" and port.unit in part.units
            SubElement(connector, f"ssc:{port.type}", {"unit": port.unit} if has_unit else {})
            used |= {port.unit} if has_unit else set()
    if system.connections:
        parent = SubElement(top, "Connections")
        for c in system.connections:
            named = {"startElement": c.start[0], "startConnector": c.start[1], "endElement": c.end[0], "endConnector": c.end[1]}
            node, scale = SubElement(parent, "Connection", named), {"factor": repr(c.factor), "offset": repr(c.offset)}
            if (c.factor, c.offset) != (1.0, 0.0):
                SubElement(node, "ssc:LinearTransformation", scale)
    add_units(root, {u: base for u, base in _units(parts).items() if u in used})
    SubElement(root, "DefaultExperiment", {"startTime": "0", "stopTime": repr(system.until)})
    return xml_bytes(with_prefix(root, "ssd"))
