"""Conversion of scenes to plain data and YAML text. Loading the result gives the same scene."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from typing import Any

from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.yaml_scalars import plain
from trunnion.scene.units.dimension_names import unit_of
from trunnion.scene.units.numbers_with_units import Computed, Quantity

WIDTH = 110
"""A group is written in one line if the line has at most this many characters."""
FIRST = (
    "schema", "name", "title", "author", "version", "date", "parameters", "gravity", "ground", "friction", "inputs",
)  # fmt: skip
"""Keys that are written before the bodies."""
_BARE = re.compile(r"[A-Za-z_][A-Za-z0-9_./^ -]*", re.ASCII)


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """The scene as nested dicts, lists and scalars (SI): schema, name, and all fields that differ from their defaults."""
    given = {"schema": scene.schema, "name": scene.name, **_group(scene)}
    if scene.parameters:
        given["parameters"] = {n: _with_unit(v) for n, v in scene.parameters.items()}
    return {key: given[key] for key in (*FIRST, *given) if key in given}


def _group(part: Any) -> dict[str, Any]:
    out = {}
    for f in fields(part):
        value = getattr(part, f.name)
        default = f.default_factory() if f.default_factory is not MISSING else f.default
        if default is MISSING or value != default:
            out[f.name] = _plain(value)
    return out


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return _group(value)
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    if isinstance(value, Computed) and value.names:
        return value.text
    return float(value) if isinstance(value, float) else value


def _with_unit(value: float) -> Any:
    """A parameter with its unit, because its path does not determine the unit."""
    if isinstance(value, Computed) and value.names:
        return value.text
    unit = unit_of(value.dimension) if isinstance(value, Quantity) else ""
    return f"{float(value)!r} {unit}" if unit else float(value)


def scene_to_yaml(scene: Scene) -> str:
    """YAML text of a scene."""
    return yaml_text(scene_to_dict(scene))


def yaml_text(data: dict[str, Any]) -> str:
    """YAML (1.2) text of nested dicts, lists and scalars. The outer levels are blocks; a short group is one line."""
    return "\n".join(_block(data, 0)) + "\n"


def _block(data: dict[str, Any], indent: int) -> Iterator[str]:
    pad = "  " * indent
    for key, value in data.items():
        flat = f"{pad}{_text(key)}: {flow(value)}"
        nested = isinstance(value, dict) and value and (indent == 0 or len(flat) > WIDTH)
        if nested:
            yield f"{pad}{_text(key)}:"
            yield from _block(value, indent + 1)
        else:
            yield flat


def flow(value: Any) -> str:
    """A value as YAML in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_text(k)}: {flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(flow, value)) + "]"
    if value is None or isinstance(value, bool):
        return "null" if value is None else str(value).lower()
    if isinstance(value, str):
        return _text(value)
    text = repr(value)
    return text[:-2] if text.endswith(".0") else text


def _text(value: str) -> str:
    """A text as YAML, with quotes if YAML would read the bare text differently."""
    bare = _BARE.fullmatch(value) and isinstance(plain(value), str) and value == value.strip()
    if not bare and '"' in value and "'" not in value and value.isprintable():
        return f"'{value}'"
    return value if bare else json.dumps(value, ensure_ascii=False)
