"""Reader of a YAML file that defines a system of FMUs: components, connections, values of parameters and their mapping, simulation
time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

from trunnion.basics.errors import SceneError
from trunnion.basics.name_patterns import suggestion
from trunnion.scene.file_format.yaml_reader import Document, read
from trunnion.scene.findings.findings_and_paths import Finding, error_of
from trunnion.scene.units.numbers_with_units import Quantity, number
from trunnion.scene.units.unit_parser import UnitError, parse_unit

KEYS = ("name", "components", "connections", "parameters", "mappings", "simulation")
LISTS = {
    "connections": ("connect", "motor.shaft.torque[1] -> crank.drive"),
    "mappings": ("map", "friction -> crank.joints.guide.friction.mu"),
}
"""{key of a list of links: (key for the text of a link with a factor or an offset, example)}."""
SCALES = ("factor", "offset")
OF_A_COMPONENT = ("scene", "fmu", "set", "outputs", "parameters")
OF_THE_RUN = {"until": (1.0, "2 s"), "step": (0.01, "1 ms")}
"""{key of ``simulation``: (default in s, example)}."""
ARROW = "->"
NAMES = "names are letters, digits and _"


@dataclass(frozen=True)
class Setting:
    """A value of a variable: factor × value + offset, in the unit of the variable. value: a number, or a text with a unit."""

    value: Any
    factor: float = 1.0
    offset: float = 0.0
    place: tuple[str | int, ...] = ()


@dataclass(frozen=True)
class Component:
    """A component of a system: an existing FMU, or a scene, which is exported with changed values and selected outputs. parameters:
    values of its parameters and inputs by name."""

    scene: str = ""
    fmu: str = ""
    changes: Mapping[str, Any] = field(default_factory=dict)
    outputs: tuple[str, ...] | None = None
    parameters: Mapping[str, Setting] = field(default_factory=dict)


@dataclass(frozen=True)
class Link:
    """A mapping of a parameter of the system to a variable (component, name). The variable receives factor × parameter + offset, in
    the unit of the variable."""

    start: str
    end: tuple[str, str]
    place: tuple[str | int, ...] = ()
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Connection:
    """A connection from an output to an input, each as (component, variable). The input receives factor × output + offset, in the
    unit of the input."""

    start: tuple[str, str]
    end: tuple[str, str]
    place: tuple[str | int, ...] = ()
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class System:
    """The contents of the file. folder: paths in the file are relative to this folder. lines, file: line numbers and file name for
    problems that are found later. parameters, mappings: the system's parameters and their mappings, or the paths of an SSV file and
    an SSM file."""

    name: str
    components: dict[str, Component]
    connections: list[Connection]
    until: float
    step: float
    folder: Path
    file: str = ""
    lines: dict[tuple[str | int, ...], int] = field(default_factory=dict)
    parameters: Mapping[str, Any] | Path = field(default_factory=dict)
    mappings: list[Link] | Path = field(default_factory=list)


class _Reader:
    """Reads the sections of a document and collects their problems."""

    def __init__(self, doc: Document):
        self.doc, self.wrong = doc, doc.findings

    def note(self, path: tuple[str | int, ...], what: str, hint: str = "") -> None:
        """Record a mistake."""
        self.wrong.append(Finding(path, what, hint, self.doc.lines.get(path, 0)))

    def group(self, data: Any, path: tuple[str | int, ...], known: tuple[str, ...] = ()) -> dict[str, Any]:
        """A group of keys. known: the allowed keys; empty if all keys are allowed. Returns an empty group if ``data`` is not a
        group.
        """
        if not isinstance(data, dict):
            if data is not None:
                self.note(path, "a group of keys is required")
            return {}
        for key in [k for k in data if known and k not in known]:
            self.note((*path, str(key)), "no such key", suggestion(str(key), known, f"one of {', '.join(known)}"))
        return data

    def component(self, name: str, data: Any) -> Component:
        """Read a component."""
        path = ("components", name)
        given = self.group(data, path, OF_A_COMPONENT)
        if not name.replace("_", "a").isalnum() or not name.isascii():
            self.note(path, f"{name!r} is not a valid name of a component", NAMES)
        if ("scene" in given) == ("fmu" in given):
            self.note(path, "give either a scene or an fmu", "scene: crank_slider, or fmu: motor.fmu")
        for key in ("set", "outputs"):
            if key in given and "fmu" in given:
                self.note((*path, key), "an existing FMU is not exported again", "omit this key, or name the FMU's scene")
        outputs = given.get("outputs")
        outputs = [outputs] if isinstance(outputs, str) else outputs
        if outputs is not None and not (isinstance(outputs, list) and all(isinstance(o, str) for o in outputs)):
            self.note((*path, "outputs"), "names or patterns of columns are required", "outputs: [ball.*]")
            outputs = None
        at = (*path, "parameters")
        values = {str(n): Setting(x, place=(*at, str(n))) for n, x in self.group(given.get("parameters"), at).items()}
        return Component(str(given.get("scene", "")), str(given.get("fmu", "")), self.group(given.get("set"), (*path, "set")),
                         None if outputs is None else tuple(outputs), values)  # fmt: skip

    def links(self, key: str, data: Any) -> Iterator[Link]:
        """Read a list of links. Each is a text "a -> b.c", or a group with this text, a factor and an offset."""
        listed = data.get(key) or []
        if not isinstance(listed, list):
            self.note((key,), "a list is required", f"- {LISTS[key][1]}")
            return
        for place, given in enumerate(listed):
            path, (word, example) = (key, place), LISTS[key]
            group = self.group(given, path, (word, *SCALES)) if isinstance(given, dict) else {word: given}
            text = group.get(word)
            ends = [e.strip() for e in str(text).split(ARROW)]
            name, _, variable = ends[-1].partition(".")
            if not isinstance(text, str) or len(ends) != 2 or not all((ends[0], name, variable)):
                self.note(path, f"a text as in the example is required, not {given!r}", example)
                continue
            scales = {k: self.plain((*path, k), group[k]) for k in SCALES if k in group}
            yield Link(ends[0], (name, variable), path, **scales)

    def connections(self, data: Any) -> Iterator[Connection]:
        """Read the connections."""
        for link in self.links("connections", data):
            name, _, variable = link.start.partition(".")
            if not (name and variable):
                self.note(link.place, f"{link.start} is not an output of a component", LISTS["connections"][1])
            yield Connection((name, variable), link.end, link.place, link.factor, link.offset)

    def contents(self, key: str, data: Any, folder: Path, suffix: str) -> Path | None:
        """The path of a file, if the key holds a path instead of the contents of the file; else None."""
        given = data.get(key)
        if not isinstance(given, str):
            return None
        file = folder / given
        if file.suffix != suffix or not file.is_file():
            self.note((key,), f"there is no file {file} with the suffix {suffix}")
        return file

    def plain(self, path: tuple[str | int, ...], value: Any) -> float:
        """Read a number without a unit; records a mistake for other values."""
        if isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(value):
            return float(value)
        self.note(path, f"{value!r} is not a plain number", f"{path[-1]}: -1")
        return 1.0

    def seconds(self, data: dict[str, Any], key: str) -> float:
        """Read a positive time, s; records a mistake for other values."""
        usual, example = OF_THE_RUN[key]
        try:
            value = number(data.get(key, usual), "a time", example)
        except UnitError as e:
            self.note(("simulation", key), str(e), e.hint)
            return usual
        if isinstance(value, Quantity) and not value.fits(parse_unit("s").dimension):
            self.note(("simulation", key), f"{value.text} is not a time", example)
        if not value > 0.0:
            self.note(("simulation", key), f"the time must be positive, not {value:g}", example)
        return float(value)


def load_system(file: Path) -> System:
    """Read the system in a file. Raises SceneError with all problems."""
    doc = read(file.read_bytes())
    reader = _Reader(doc)
    data = reader.group(doc.data, (), KEYS)
    components = {str(n): reader.component(str(n), c) for n, c in reader.group(data.get("components"), ("components",)).items()}
    if not components and not doc.findings:
        reader.note(("components",), "a system has at least one component")
    connections = list(reader.connections(data))
    folder = file.parent
    parameters = reader.contents("parameters", data, folder, ".ssv") or reader.group(data.get("parameters"), ("parameters",))
    mappings = reader.contents("mappings", data, folder, ".ssm") or list(reader.links("mappings", data))
    run = reader.group(data.get("simulation"), ("simulation",), tuple(OF_THE_RUN))
    made = System(str(data.get("name", file.stem)), components, connections, reader.seconds(run, "until"),
                  reader.seconds(run, "step"), folder, str(file), doc.lines, parameters, mappings)  # fmt: skip
    if doc.findings:
        found_wrong = error_of(doc.findings, doc.lines, str(file))
        raise SceneError([replace(p, where="system") if p.where == "scene" else p for p in found_wrong.problems])
    return made
