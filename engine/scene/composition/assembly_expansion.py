"""Expansion of assemblies. This module renames the parts of a file or group, and makes them bodies and joints of the enclosing
scene."""

from __future__ import annotations

from typing import Any

from trunnion.scene.composition import reference_renaming
from trunnion.scene.composition.assembly_copies import Copy, copies
from trunnion.scene.composition.data_with_source_lines import Level, copy_of
from trunnion.scene.composition.file_includes import merge_includes, part_of_file
from trunnion.scene.composition.part_transformations import move_part
from trunnion.scene.data_classes.type_tree import keys_at
from trunnion.scene.findings.findings_and_paths import Path
from trunnion.scene.findings.name_suggestions import closest, did_you_mean, shown
from trunnion.scene.units.unit_parser import UnitError

SECTIONS = ("bodies", "joints", "forces", "inputs")
IGNORED = ("title", "name", "schema")
PART = ("assemblies", "*", "use")
Points = dict[str, dict[str, str]]
"""For each assembly: {name of a point of the assembly: the "body.point" of the scene that the name stands for}."""


def expand_assemblies(level: Level) -> Points:
    """Replace the includes and assemblies of a level by bodies and joints. Returns the points that the assemblies name."""
    merge_includes(level)
    reference_renaming.restore_on(level.data)
    given = level.data.pop("assemblies", None)
    offered: Points = {}
    if isinstance(given, dict):
        for name, spec in given.items():
            _add_assembly(level, name, spec, offered)
    elif given is not None:
        level.add_problem(("assemblies",), f"a group of keys is expected, not {shown(given)}", "entries are NAME: {use: FILE}")
    if offered:
        _resolve_points(level, offered)
    return offered


def _add_assembly(level: Level, name: str, spec: Any, offered: Points) -> None:
    """Add the bodies and joints of one assembly, with all its copies, to its level."""
    path: Path = ("assemblies", name)
    if not isinstance(spec, dict) or not isinstance(spec.get("use"), str | dict):
        level.add_problem(path, "an assembly needs use: the name of a file, or a group of parts", "NAME: {use: FILE, with: {…}}")
        return
    if not _has_known_keys(level, path, spec, keys_at(("assemblies", "*"))):
        return
    use = spec["use"]
    part = part_of_file(level, (*path, "use"), use) if isinstance(use, str) else level.below((*path, "use"), use)
    if part is None:
        return
    expand_assemblies(part)
    level.findings += part.findings
    if not _has_known_keys(part, (), part.data, [*keys_at(PART), *IGNORED], level):
        return
    wanted = copies(level, path, spec)
    for copy in wanted:
        _add_copy(level, path, name, spec, part, copy, offered)


def _has_known_keys(level: Level, path: Path, given: dict[str, Any], known: list[str], teller: Level | None = None) -> bool:
    """Whether all keys of a group are known. For each unknown key, the function adds a finding to ``level``, and also to ``teller``
    if given."""
    wrong = [k for k in given if k not in known]
    for key in wrong:
        hint = did_you_mean(key, known, "known keys") if closest(key, known) else f"known keys: {', '.join(known)}"
        level.add_problem((*path, key), f"unknown key {shown(key)}", hint)
    if teller is not None and wrong:
        teller.findings += level.findings[-len(wrong) :]
    return not wrong


def _add_copy(level: Level, path: Path, name: str, spec: dict[str, Any], part: Level, copy: Copy, offered: Points) -> None:
    """Add one copy of an assembly to its level, after numbering, transformation and renaming."""
    prefix = f"{name}{copy.suffix}"
    try:
        data = _number_names(copy_of(part.data), copy.number)
        data, notes = move_part(data, copy.moves)
    except UnitError as e:
        level.add_problem(path, e.what, e.hint)
        return
    for at, what, hint in notes:
        level.add_problem((*path, "copies") if "copies" in spec else path, f"{'.'.join(map(str, at))}: {what}", hint)
    own = {s: {n: f"{prefix}_{n}" for n in _group(data, s)} for s in (*SECTIONS, "parameters")}
    ground = {n: f"{prefix}_{n}" for n in _group(_group(data, "ground"), "points")}
    names = ({"i": str(copy.number)} if copy.number else {}) | own["parameters"]
    _add_parameters(level, path, spec, data, part, own["parameters"], names, copy)

    def rename(text: str, at: Path) -> str:
        body, dot, point = text.partition(".")
        if body == "ground":
            return f"ground.{ground.get(point, point)}" if dot else text
        return own["bodies"].get(body, body) + dot + point

    for section in SECTIONS:
        for n, value in _group(data, section).items():
            value = reference_renaming.rename_references(section, n, value, rename)
            if section == "joints":
                value = reference_renaming.rename_leading_joint(value, lambda leader: own["joints"].get(leader, leader))
            value = reference_renaming.rename_inputs(value, own["inputs"]) if section in ("joints", "forces") else value
            value = reference_renaming.rename_parameters(value, names)
            _add_value(level, path, (section, own[section][n]), value, part, (section, n), bool(copy.number))
    for n, value in _group(_group(data, "ground"), "points").items():
        place = reference_renaming.rename_parameters(value, names)
        _add_value(level, path, ("ground", "points", ground[n]), place, part, ("ground", "points", n), bool(copy.number))
    points = _group(data, "points")
    offered[prefix] = {n: rename(p, ()) for n, p in points.items() if isinstance(p, str)}


def _number_names(data: dict[str, Any], number: int) -> dict[str, Any]:
    """A copy of the part in which the number of the copy replaces {i} in references."""
    if not number:
        return data

    def rename(text: str, at: Path = ()) -> str:
        return reference_renaming.number_name(text, number)

    _rename_in(data, rename)
    joints = _group(data, "joints")
    joints |= {n: reference_renaming.rename_leading_joint(j, rename) for n, j in joints.items()}
    return data


def _rename_in(data: dict[str, Any], rename: reference_renaming.Renamer) -> None:
    """Rename, in place, the bodies and points that joints and forces refer to."""
    for section in ("joints", "forces"):
        for n, value in _group(data, section).items():
            data[section][n] = reference_renaming.rename_references(section, n, value, rename)


def _group(data: Any, key: str) -> dict[str, Any]:
    found = data.get(key) if isinstance(data, dict) else None
    return found if isinstance(found, dict) else {}


def _add_value(level: Level, path: Path, where: Path, value: Any, part: Level, at: Path, copy: bool) -> None:
    owner = level.data
    for key in where[:-1]:
        owner = _group(owner, str(key))
    if where[-1] in owner:
        hint = "rename the assembly or the other part"
        level.add_problem(path, f"the name {shown(where[-1])} of {'.'.join(map(str, at))} is already used in {where[0]}", hint)
        return
    level.take(where, value, part, at, copy)


def _add_parameters(
    level: Level, path: Path, spec: dict[str, Any], data: dict[str, Any], part: Level, own: dict[str, str], names: dict[str, str],
    copy: Copy,
) -> None:  # fmt: skip
    """Add the parameters of a copy to its level; values under ``with`` replace the part's own. own: {parameter of the part: its new
    name}; names: the names in ``own``, and the name i for the number of the copy."""
    given = _group(spec, "with")
    for name in given:
        if name not in own:
            what = f"the part has no parameter {shown(name)}"
            level.add_problem((*path, "with", name), what, did_you_mean(name, own, "parameters"))
    number = {"i": str(copy.number)} if copy.number else {}
    for name, value in _group(data, "parameters").items():
        if name in given:
            value = reference_renaming.rename_parameters(given[name], number)
            _add_value(level, path, ("parameters", own[name]), value, level, (*path, "with", name), bool(copy.number))
        else:
            value = reference_renaming.rename_parameters(value, names)
            _add_value(level, path, ("parameters", own[name]), value, part, ("parameters", name), bool(copy.number))


def _resolve_points(level: Level, offered: Points) -> None:
    """Replace references to points of assemblies by references to points of the assemblies' bodies."""

    def rename(text: str, at: Path) -> str:
        body, _, point = text.partition(".")
        if body not in offered or body in _group(level.data, "bodies"):
            return text
        if point in offered[body]:
            return offered[body][point]
        hint = did_you_mean(point, offered[body], "points") or f"give it one: points: {{{point or 'NAME'}: BODY.POINT}}"
        what = f"the assembly {body} has no point {shown(point)}" if point else f"{body} is an assembly, not a body"
        level.add_problem(at, what, hint)
        return text

    _rename_in(level.data, rename)
    points = level.data.get("points")
    if isinstance(points, dict):
        level.data["points"] = {n: rename(p, ("points", n)) if isinstance(p, str) else p for n, p in points.items()}
