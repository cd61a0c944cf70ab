"""Changes of values at dotted paths in a scene's plain data, before validation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from typing import Any

from trunnion.basics.errors import Problem
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.renamed_words import current_paths
from trunnion.scene.data_classes.type_tree import classes_at, keys_at, shape, unit_at
from trunnion.scene.expressions.parameter_evaluation import NAMED, Parameters, is_expression, parameters_of
from trunnion.scene.findings.findings_and_paths import Finding, Path, dotted, parse_path
from trunnion.scene.findings.name_suggestions import Nearest, closest, shown
from trunnion.scene.units.dimension_names import unit_of
from trunnion.scene.units.numbers_with_units import Computed, NoValue, Quantity, agree, number
from trunnion.scene.units.unit_parser import UnitError


@dataclass(frozen=True)
class WrongPath:
    """A path that does not exist: the path as written, the reason, and a hint."""

    text: str
    what: str
    hint: str | Nearest = ""

    def problem(self, every_path: Callable[[], list[str]] = list) -> Problem:
        """The problem for the user. When no key is close, the hint is the shortest path in ``every_path`` that ends with the text,
        else the closest path."""
        hint = str(self.hint)
        if hint.startswith("known") and every_path():
            ends = [p for p in every_path() if p.endswith(f".{self.text}")]
            near = min(ends, key=lambda p: p.count("."), default="") or closest(self.text, every_path())
            hint = f'did you mean "{near}"?' if near else hint
        return Problem(self.text, self.what, hint)


def set_values(data: dict[str, Any], changes: Mapping[str, Any]) -> list[WrongPath]:
    """Set values in a scene's nested dicts and lists, in place. The function adds missing groups and defaults on the way.

    A plain number for a parameter is in the SI unit of the parameter's dimension. The result lists the paths that do not
    exist.
    """
    given = data.get(NAMED)
    parameters = dict(given) if isinstance(given, dict) else {}
    known = cache(lambda: parameters_of(parameters))
    wrong = []
    for text, value in current_paths(changes).items():
        path = parse_path(text)
        if path is None:
            wrong.append(WrongPath(text, "not a path", "paths look like joints.ball.friction.mu or gravity[3]"))
            continue
        if path[0] == NAMED and len(path) == 2 and path[1] in parameters:
            value = _measured(parameters[path[1]], value, known)
        if found := _set(data, path, value):
            wrong.append(WrongPath(text, found.what, found.hint))
    return wrong


def opened(value: Any) -> Any:
    """A scene, or a part of it, as nested dicts and lists with all fields; a field without a value is None."""
    if is_dataclass(value):
        return {f.name: opened(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, dict):
        return {k: opened(v) for k, v in value.items()}
    if isinstance(value, Computed) and value.names:
        return value.text  # keep the expression: a change may set its parameters
    return [opened(v) for v in value] if isinstance(value, tuple) else value


def _set(data: Any, path: Path, value: Any) -> Finding | None:
    """Set one value. The result is a finding if a step of the path does not exist, else None."""
    node = data
    for i, key in enumerate(path):
        here = path[: i + 1]
        if found := _missing(node, here):
            return found
        if i == len(path) - 1:
            node[key] = value
            if key == "formula":
                node.pop("numbers", None)  # drop the old formula's constant parts
            return None
        inside = node[key] if isinstance(key, int) else node.get(key)
        if inside is None:
            inside = node[key] = _default(here)
        if path[i + 1 :] == (0,) and _is_number(inside, here):
            node[key] = value  # q[1] means q if the scene gives q as a number instead of a list
            return None
        node = inside
    return None


def _is_number(value: Any, path: Path) -> bool:
    return isinstance(value, int | float) or (isinstance(value, str) and unit_at(shape(path)) is not None)


def _default(path: Path) -> Any:
    """The default of the field at a path, as nested dicts and lists; an empty group if there is no default."""
    for cls in classes_at(shape(path[:-1])):
        for f in fields(cls):
            if f.name == path[-1]:
                default = f.default if f.default_factory is MISSING else f.default_factory()
                return {} if default is None or default is MISSING else opened(default)
    return {}


def _measured(old: Any, value: Any, known: Callable[[], Parameters]) -> Any:
    """A parameter's new value. A plain number is in the SI unit of the old value's dimension."""
    if is_expression(value):
        return value
    try:
        old = known().computed(old) if is_expression(old) else number(old)
    except UnitError:
        return value
    if not isinstance(old, Quantity):
        return value
    try:
        new = number(value)
        if isinstance(new, Quantity):
            agree(new, unit_of(old.dimension) or "1")
    except UnitError as e:
        return NoValue(str(value), e.what, e.hint)
    return Quantity(new, old.dimension, new.text if isinstance(new, Quantity) else f"{new!r} {unit_of(old.dimension)}")


def _missing(node: Any, path: Path) -> Finding | None:
    """A finding if the last key of ``path`` does not exist in ``node``; None if it exists."""
    key, owner = path[-1], dotted(path[:-1])
    if isinstance(key, int):
        if not isinstance(node, list):
            return Finding(path, f"{owner} is not a list")
        what = f"{owner} has {len(node)} entries: no [{key + 1}]"
        return None if key < len(node) else Finding(path, what, "the first is [1]")
    if not isinstance(node, dict):
        what = f"{owner} is a list" if isinstance(node, list) else f"{owner} has no parts"
        return Finding(path, what, f"its first entry is {owner}[1]" if isinstance(node, list) else "")
    known = keys_at(path[:-1]) or node
    if key in known:
        return None
    return Finding(path, f"{owner} has no {shown(key)}", Nearest(key, known))
