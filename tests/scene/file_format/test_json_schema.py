"""The published JSON Schema has an entry for every key, and accepts all input that the loader accepts."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from typing import Any

import pytest

from tests.scene.valid_scene import GONE, VALID, edited
from trunnion.scene import load_scene, model_names, scene_to_dict
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.json_schema import json_schema

SCHEMA = json_schema()


def test_every_key_of_every_group_has_a_description():
    groups = {"Scene": SCHEMA, **SCHEMA["$defs"]}
    assert set(SCHEMA["properties"]) == {f.name for f in fields(Scene)}
    for name, group in groups.items():
        assert group["description"], name
        for key, value in group["properties"].items():
            assert len(value.get("description", "")) > 3, f"{name}.{key}"


KEYWORDS = {
    "$ref", "$defs", "$schema", "title", "description", "default", "type", "properties", "required", "enum", "const",
    "additionalProperties", "anyOf", "items", "minItems", "maxItems", "minimum", "exclusiveMinimum", "maximum", "not",
}  # fmt: skip


def faults(value: Any, schema: dict[str, Any], path: str = "$") -> list[str]:
    """Places at which a value violates the schema. Only the keywords of the published schema are supported."""
    assert set(schema) <= KEYWORDS, set(schema) - KEYWORDS
    if "$ref" in schema:
        schema = {
            **SCHEMA["$defs"][schema["$ref"].rsplit("/", 1)[1]],
            **{k: v for k, v in schema.items() if k != "$ref"},
        }
    out: list[str] = []
    if "anyOf" in schema and not any(not faults(value, s, path) for s in schema["anyOf"]):
        out.append(f"{path}: none of the alternatives")
    if "const" in schema and value != schema["const"]:
        out.append(f"{path}: not {schema['const']}")
    if "enum" in schema and value not in schema["enum"]:
        out.append(f"{path}: not one of {schema['enum']}")
    if "type" in schema and not is_type(value, schema["type"]):
        return [*out, f"{path}: not {schema['type']}"]
    if isinstance(value, int | float) and not isinstance(value, bool):
        low, above, high = (schema.get(k) for k in ("minimum", "exclusiveMinimum", "maximum"))
        beyond = (low is not None and value < low) or (above is not None and value <= above) or (high is not None and value > high)
        out += [f"{path}: out of range"] if beyond or ("not" in schema and not faults(value, schema["not"], path)) else []
    if isinstance(value, dict):
        extra = schema.get("additionalProperties", True)
        out += [f"{path}.{k}: missing" for k in schema.get("required", ()) if k not in value]
        for k, v in value.items():
            inner = schema.get("properties", {}).get(k, extra)
            if inner is not True:
                out += faults(v, inner, f"{path}.{k}") if inner else [f"{path}.{k}: unknown"]
    if isinstance(value, list):
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            out.append(f"{path}: length")
        out += [f for i, v in enumerate(value) for f in faults(v, schema.get("items", {}), f"{path}[{i}]")]
    return out


def is_type(value: Any, names: str | list[str]) -> bool:
    """Whether a value has one of the types that JSON Schema names."""
    kinds = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None), "integer": int}
    for name in [names] if isinstance(names, str) else names:
        if name == "number" and isinstance(value, int | float) and not isinstance(value, bool):
            return True
        if name in kinds and isinstance(value, kinds[name]):
            return True
    return False


def test_the_schema_accepts_one_of_everything():
    assert faults(json.loads(json.dumps(VALID)), SCHEMA) == []


@pytest.mark.parametrize("name", model_names())
def test_the_schema_accepts_every_model(name):
    assert faults(scene_to_dict(load_scene(name)), SCHEMA) == []


@pytest.mark.parametrize(
    "changes",
    [
        {"bodies": GONE},
        {"bodies.arm.masss": 1},
        {"bodies.arm.box": [1, 2]},
        {"joints.hinge.type": "hinge"},
        {"joints.hinge.inboard": GONE},
        {"joints.hinge.axis": "w"},
        {"joints.socket.friction.mu": [1]},
        {"joints.hinge.pin": "left"},
        {"forces.push.type": "pull"},
        {"gravity": 9.81},
        {"schema": 2},
        {"title": 3},
        {"joints.socket.friction.mu": -0.1},
        {"bodies.arm.box": [1, 0, 1]},
        {"simulation.rtol": 1},
    ],
)
def test_the_schema_refuses_what_the_loader_refuses(changes):
    assert faults(edited(changes), SCHEMA)


def test_the_descriptions_name_units():
    text = SCHEMA["$defs"]["Friction"]["properties"]["v_eps"]["description"]
    assert re.search(r'velocity in m/s, or text such as "1e-4 m/s"', text)
