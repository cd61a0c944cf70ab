"""The scene format as JSON Schema (draft 2020-12), generated from the data classes: types, units, descriptions."""

from __future__ import annotations

import ast
import inspect
import math
import sys
from dataclasses import MISSING, Field, is_dataclass
from functools import cache
from typing import Annotated, Any, Literal, get_args, get_origin

from trunnion.basics.number_declarations import Bound
from trunnion.scene.data_classes.field_types import Says
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.data_classes.type_tree import fields_by_key, hints, members, required_fields
from trunnion.scene.units.dimension_names import QUANTITIES
from trunnion.scene.units.numbers_with_units import AnyUnit


def json_schema() -> dict[str, Any]:
    """The schema of scenes as nested dicts."""
    defs: dict[str, Any] = {}
    _class(Scene, defs)
    top = defs.pop("Scene")
    top["anyOf"] = [{"required": top.pop("required")}, {"required": ["assemblies"]}, {"required": ["include"]}]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Trunnion scene",
        **top,
        "$defs": {name: defs[name] for name in sorted(defs)},
    }


def _class(cls: type, defs: dict[str, Any]) -> dict[str, Any]:
    """A reference to the schema of a class; the definition is added to ``defs``."""
    if cls.__name__ not in defs:
        defs[cls.__name__] = {}
        docs = _module_docs(cls.__module__).get(cls.__name__, {}) | getattr(cls, "__field_docs__", {})
        every = fields_by_key(cls).items()
        properties = {key: _property(f, hints(cls)[f.name], docs.get(f.name, ""), defs) for key, f in every}
        defs[cls.__name__] = {
            "type": "object",
            "description": _line(inspect.cleandoc(cls.__doc__ or "")),
            "properties": properties,
            "required": required_fields(cls),
            "additionalProperties": False,
        }
    return {"$ref": f"#/$defs/{cls.__name__}"}


def _property(f: Field[Any], annotation: Any, doc: str, defs: dict[str, Any]) -> dict[str, Any]:
    out = _type(annotation, defs)
    marks = get_args(annotation)[1:] if get_origin(annotation) is Annotated else ()
    said = [m.text for m in marks if isinstance(m, Says)]
    text = " ".join(part for part in (doc, out.pop("description", ""), *said) if part)
    if text:
        out["description"] = text
    if f.default is not MISSING and f.default is not None:
        out["default"] = list(f.default) if isinstance(f.default, tuple) else f.default
    return out


def _type(annotation: Any, defs: dict[str, Any]) -> dict[str, Any]:
    """The schema of an annotation; alternatives become anyOf."""
    options = [_member(a, unit, defs) for a, unit in members(annotation)]
    if len(options) == 1:
        return options[0]
    return {"anyOf": options}


def _member(a: Any, unit: AnyUnit | None, defs: dict[str, Any]) -> dict[str, Any]:
    origin = get_origin(a)
    if a is float:
        return _number(unit)
    if isinstance(a, type) and is_dataclass(a):
        group = _class(a, defs)
        return {"anyOf": [{"type": "string"}, group]} if hasattr(a, "__text_key__") else group
    if origin is Literal:
        choices = list(get_args(a))
        return {"const": choices[0]} if len(choices) == 1 else {"enum": choices}
    if origin is dict:
        return {"type": "object", "additionalProperties": _type(get_args(a)[1], defs)}
    if origin is tuple:
        return _list(get_args(a), defs)
    return {"type": {str: "string", bool: "boolean", int: "integer"}[a]}


def _list(args: tuple[Any, ...], defs: dict[str, Any]) -> dict[str, Any]:
    items = _type(args[0], defs)
    if len(args) > 1 and args[-1] is not Ellipsis:
        return {"type": "array", "items": items, "minItems": len(args), "maxItems": len(args)}
    if any(m is type(None) for m in get_args(args[0])):  # null is allowed for a freedom without an entry
        items = {"anyOf": [items, {"type": "null"}]}
    return {"type": "array", "items": items}


def _number(unit: AnyUnit | None) -> dict[str, Any]:
    """The schema of a number: SI, or text with a unit."""
    out: dict[str, Any] = {"type": ["number", "string"]}
    out |= _range(unit.bound) if unit is not None else {}
    if unit is not None and unit.unit:
        name, example = QUANTITIES[unit.unit]
        si = "" if unit.unit == "1" else f" in {unit.unit}"
        out["description"] = f'({name.removeprefix("a ").removeprefix("an ")}{si}, or text such as "{example}")'
    return out


def _range(bound: Bound) -> dict[str, Any]:
    """The part of a schema that bounds a plain number."""
    out: dict[str, Any] = {}
    if bound.least > -math.inf:
        out["exclusiveMinimum" if bound.open else "minimum"] = bound.least
    if bound.most < math.inf:
        out["maximum"] = bound.most
    return out | ({"not": {"const": 0}} if bound.nonzero else {})


@cache
def _module_docs(module: str) -> dict[str, dict[str, str]]:
    """For every class and field of a module, the string literal after the field in the source."""
    out: dict[str, dict[str, str]] = {}
    for node in ast.parse(inspect.getsource(sys.modules[module])).body:
        if not isinstance(node, ast.ClassDef):
            continue
        docs = out.setdefault(node.name, {})
        for field, below in zip(node.body, node.body[1:], strict=False):
            text = below.value if isinstance(below, ast.Expr) else None
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(text, ast.Constant):
                docs[field.target.id] = _line(inspect.cleandoc(str(text.value)))
    return out


def _line(text: str) -> str:
    return " ".join(text.split())
