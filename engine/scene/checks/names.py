"""Checks of names: their form, reserved words, duplicates, and references to parts that do not exist."""

from __future__ import annotations

import re
from collections.abc import Iterator

from trunnion.scene.data_classes.loads import Input
from trunnion.scene.data_classes.scene import Drive, FromInput, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.findings.name_suggestions import Nearest, shown
from trunnion.scene.queries.body_references import GROUND, Reference, points_of, references
from trunnion.scene.queries.loads_and_signals import loads, signals
from trunnion.scene.queries.numbers_by_path import unit_of
from trunnion.scene.units.dimension_names import fits
from trunnion.scene.units.unit_parser import UnitError, parse_unit

RESERVED = (GROUND, "time", "energy", "audit", "events")
_FORM = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about names."""
    yield from _own_names(scene)
    parts = [*scene.bodies, GROUND]
    for r in references(scene):
        yield from _reference(scene, r, parts)
    for name, given in scene.inputs.items():
        yield from _input_unit(("inputs", name, "unit"), given)
    for path, load in loads(scene):
        if isinstance(load, FromInput):
            yield from _from_input(scene, path, load)
    for path, signal in signals(scene):
        if isinstance(signal, Drive) and signal.input is not None:
            yield from _from_input(scene, path, signal)


def _own_names(scene: Scene) -> Iterator[Finding]:
    seen: dict[str, str] = {}
    for section in ("bodies", "joints", "forces", "inputs"):
        for name in getattr(scene, section):
            path: Path = (section, name)
            yield from _form(path, name)
            if name in RESERVED:
                yield Finding(path, f'the name "{name}" is reserved', f"reserved: {', '.join(RESERVED)}")
            if name in seen:
                yield Finding(path, f'the name "{name}" is already taken by {seen[name]}', "choose another name")
            seen.setdefault(name, f"one of the {section}")
    for path, points in ((("ground",), scene.ground.points), *((("bodies", n), b.points) for n, b in scene.bodies.items())):
        for name in points:
            yield from _form((*path, "points", name), name)
    for body, b in scene.bodies.items():
        for name in b.start:
            if name not in b.points:
                hint = Nearest(name, b.points, "points")
                yield Finding(("bodies", body, "start", name), f"{body} has no point {shown(name)}", hint)


def _form(path: Path, name: str) -> Iterator[Finding]:
    if not _FORM.fullmatch(name):
        yield Finding(path, f"{shown(name)} cannot be a name", "a letter, then letters, digits and _")


def _reference(scene: Scene, r: Reference, parts: list[str]) -> Iterator[Finding]:
    """Findings if a joint side, a load or an end of a spring names an unknown body or point; ``parts`` are the existing names."""
    if r.body == GROUND and r.use == "load":
        yield Finding(r.path, "a load cannot act on the ground", "name a body")
        return
    if r.body != GROUND and r.body not in scene.bodies:
        hint = Nearest(r.body, scene.bodies if r.use == "load" else parts, "bodies")
        yield Finding(r.path, f"there is no body {shown(r.body)}", hint, about=(("bodies", r.body),))
        return
    points = points_of(scene, r.body)
    if r.point and r.point not in points:
        owner: Path = ("ground",) if r.body == GROUND else ("bodies", r.body)
        hint = Nearest(r.point, points, "points", f"add it to {'.'.join(map(str, owner))}.points")
        what = f"{'the ground' if r.body == GROUND else shown(r.body)} has no point {shown(r.point)}"
        yield Finding(r.path, what, hint, about=((*owner, "points", r.point),))


def _input_unit(path: Path, given: Input) -> Iterator[Finding]:
    try:
        unit = parse_unit("" if given.unit == "1" else given.unit)
    except UnitError as e:
        yield Finding(path, e.what, e.hint)
        return
    if unit.factor != 1.0:
        yield Finding(path, f"inputs are in SI units; {shown(given.unit)} is not", "convert the values; write for example N or rad")


def _from_input(scene: Scene, path: Path, load: FromInput | Drive) -> Iterator[Finding]:
    assert load.input is not None
    if load.input not in scene.inputs:
        hint = Nearest(load.input, scene.inputs, "inputs", f"add inputs: {{{load.input}: {{}}}}")
        yield Finding((*path, "input"), f"there is no input {shown(load.input)}", hint, about=(("inputs", load.input),))
        return
    declared, wanted = scene.inputs[load.input].unit, unit_of(scene, path)
    if declared == "1":
        return
    try:
        given = parse_unit(declared).dimension
    except UnitError:
        return  # _input_unit reports this invalid unit
    if not fits(given, parse_unit(wanted).dimension):
        yield Finding((*path, "input"), f'the input "{load.input}" is in {declared}; {wanted} is expected here')
