"""Assemblies: parts from files or groups, under names of their own, become bodies and joints of the scene around them."""

from __future__ import annotations

from typing import Any

from engine.scene.finding import Path
from engine.scene.suggest import closest, did_you_mean, shown
from engine.scene.typed import keys_at
from engine.scene.units import UnitError
from engine.scene.written import names
from engine.scene.written.copying import Copy, copies
from engine.scene.written.including import included, part_of_file
from engine.scene.written.moving import moved
from engine.scene.written.origins import Level, copied

SECTIONS = ("bodies", "joints", "forces", "inputs")
IGNORED = ("title", "name", "schema")
PART = ("assemblies", "*", "use")
Points = dict[str, dict[str, str]]
"""For every assembly by name, what its own names for points mean."""


def assembled(level: Level) -> Points:
    """Replace the includes and assemblies of a level by what they stand for; the names for points that assemblies offer."""
    included(level)
    names.read_on(level.data)
    given = level.data.pop("assemblies", None)
    offered: Points = {}
    if isinstance(given, dict):
        for name, spec in given.items():
            _used(level, name, spec, offered)
    elif given is not None:
        level.told(("assemblies",), f"a group of keys is wanted, not {shown(given)}", "entries look like NAME: {use: FILE}")
    if offered:
        _resolve(level, offered)
    return offered


def _used(level: Level, name: str, spec: Any, offered: Points) -> None:
    """Put one assembly, with all its copies, into its level."""
    path: Path = ("assemblies", name)
    if not isinstance(spec, dict) or not isinstance(spec.get("use"), str | dict):
        level.told(path, "an assembly needs use: the name of a file, or a group of parts", "NAME: {use: FILE, with: {…}}")
        return
    if not _known(level, path, spec, keys_at(("assemblies", "*"))):
        return
    use = spec["use"]
    part = part_of_file(level, (*path, "use"), use) if isinstance(use, str) else level.below((*path, "use"), use)
    if part is None:
        return
    assembled(part)
    level.findings += part.findings
    if not _known(part, (), part.data, [*keys_at(PART), *IGNORED], level):
        return
    wanted = copies(level, path, spec)
    for copy in wanted:
        _copy(level, path, name, spec, part, copy, offered)


def _known(level: Level, path: Path, given: dict[str, Any], known: list[str], teller: Level | None = None) -> bool:
    """Whether a group has only keys that it may have; others are noted."""
    wrong = [k for k in given if k not in known]
    for key in wrong:
        hint = did_you_mean(key, known, "known keys") if closest(key, known) else f"known keys: {', '.join(known)}"
        level.told((*path, key), f"unknown key {shown(key)}", hint)
    if teller is not None and wrong:
        teller.findings += level.findings[-len(wrong) :]
    return not wrong


def _copy(level: Level, path: Path, name: str, spec: dict[str, Any], part: Level, copy: Copy, offered: Points) -> None:
    """Put one copy of an assembly into its level: its numbers, its place, its names."""
    prefix = f"{name}{copy.suffix}"
    try:
        data = _numbered(copied(part.data), copy.number)
        data, notes = moved(data, copy.moves)
    except UnitError as e:
        level.told(path, e.what, e.hint)
        return
    for at, what, hint in notes:
        level.told((*path, "copies") if "copies" in spec else path, f"{'.'.join(map(str, at))}: {what}", hint)
    own = {s: {n: f"{prefix}_{n}" for n in _group(data, s)} for s in (*SECTIONS, "parameters")}
    ground = {n: f"{prefix}_{n}" for n in _group(_group(data, "ground"), "points")}
    _parameters(level, path, spec, data, part, own["parameters"], copy)
    more = {"i": str(copy.number)} if copy.number and "i" not in own["parameters"] else {}

    def rename(text: str, at: Path) -> str:
        body, dot, point = text.partition(".")
        if body == "ground":
            return f"ground.{ground.get(point, point)}" if dot else text
        return own["bodies"].get(body, body) + dot + point

    for section in SECTIONS:
        for n, value in _group(data, section).items():
            value = names.mapped(section, n, value, rename)
            value = names.inputs(value, own["inputs"]) if section in ("joints", "forces") else value
            value = names.expressions(value, own["parameters"] | more)
            _put(level, path, (section, own[section][n]), value, part, (section, n), bool(copy.number))
    for n, value in _group(_group(data, "ground"), "points").items():
        place = names.expressions(value, own["parameters"] | more)
        _put(level, path, ("ground", "points", ground[n]), place, part, ("ground", "points", n), bool(copy.number))
    points = _group(data, "points")
    offered[prefix] = {n: rename(p, ()) for n, p in points.items() if isinstance(p, str)}


def _numbered(data: dict[str, Any], number: int) -> dict[str, Any]:
    """A part in which {i} in names is the number of the copy."""
    if not number:
        return data
    for section in ("joints", "forces"):
        for n, value in _group(data, section).items():
            data[section][n] = names.mapped(section, n, value, lambda text, at: names.numbered(text, number))
    return data


def _group(data: Any, key: str) -> dict[str, Any]:
    found = data.get(key) if isinstance(data, dict) else None
    return found if isinstance(found, dict) else {}


def _put(level: Level, path: Path, where: Path, value: Any, part: Level, at: Path, copy: bool) -> None:
    owner = level.data
    for key in where[:-1]:
        owner = _group(owner, str(key))
    if where[-1] in owner:
        hint = "rename the assembly, or the other"
        level.told(path, f"the name {shown(where[-1])} of {'.'.join(map(str, at))} is taken already in the {where[0]}", hint)
        return
    level.take(where, value, part, at, copy)


def _parameters(
    level: Level, path: Path, spec: dict[str, Any], data: dict[str, Any], part: Level, own: dict[str, str], copy: Copy
) -> None:
    """Put the parameters of a copy into its level, with the values it is given there."""
    given = _group(spec, "with")
    for name in given:
        if name not in own:
            level.told((*path, "with", name), f"it has no parameter {shown(name)}", did_you_mean(name, own, "parameters"))
    number = {"i": str(copy.number)} if copy.number else {}
    for name, value in _group(data, "parameters").items():
        if name in given:
            value = names.expressions(given[name], number)
            _put(level, path, ("parameters", own[name]), value, level, (*path, "with", name), bool(copy.number))
        else:
            more = number if "i" not in own else {}
            value = names.expressions(value, own | more)
            _put(level, path, ("parameters", own[name]), value, part, ("parameters", name), bool(copy.number))


def _resolve(level: Level, offered: Points) -> None:
    """Replace the points that assemblies offer by those of their bodies."""

    def rename(text: str, at: Path) -> str:
        body, _, point = text.partition(".")
        if body not in offered or body in _group(level.data, "bodies"):
            return text
        if point in offered[body]:
            return offered[body][point]
        hint = did_you_mean(point, offered[body], "points") or f"give it one: points: {{{point or 'NAME'}: BODY.POINT}}"
        level.told(at, f"the assembly {body} has no point {shown(point)}" if point else f"{body} is an assembly, not a body", hint)
        return text

    for section in ("joints", "forces"):
        for n, value in _group(level.data, section).items():
            level.data[section][n] = names.mapped(section, n, value, rename)
    points = level.data.get("points")
    if isinstance(points, dict):
        level.data["points"] = {n: rename(p, ("points", n)) if isinstance(p, str) else p for n, p in points.items()}
