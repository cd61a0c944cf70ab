"""The reference of the scene format as one page, made from the data classes: every key with its meaning, its unit, what it is when
left out, and an example. ``python -m engine.scene.reference`` writes it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path as FilePath
from typing import Any

from engine.scene.dump import flow
from engine.scene.reading import read
from engine.scene.schema import json_schema

PAGE = FilePath(__file__).resolve().parents[1] / "SCENE.md"
EXAMPLES = FilePath(__file__).with_name("examples.yaml")
LONGEST = 60
"""Characters of an example, at most; what is longer is shown as a group."""
ORDER = (
    "Body", "Cylinder", "Turn", "Ground", "Joint", "Side", "Friction", "FrictionDefaults", "Start", "AxisAngle", "Spring",
    "Stops", "Latch", "Drive", "Motor", "Signal", "Constant", "Ramp", "Harmonic", "Table", "FromInput", "InputCurve",
    "BySpeed", "Force", "Torque", "SpringDamper", "Bushing", "Input", "Simulation", "Assembly", "Part", "Copies", "Mirror",
    "Rotate", "Line",
)  # fmt: skip
"""Groups in the order in which a reader needs them; others follow by name."""
HEAD = """\
# Scenes: every key

Made from the data classes by `python -m engine.scene.reference`; a test holds it up to date. `trunnion new NAME` writes a scene
to start from, `trunnion check FILE` lists every mistake at once; the same as JSON Schema, for editors, is
[scene.schema.json](scene/scene.schema.json). An example of everything is [examples.yaml](scene/examples.yaml).

**Numbers** are SI: m, kg, s, rad, N. Text with a unit is converted: `30 mm`, `45 deg`, `60 rpm`, `7.8 g/cm^3`, `2 kN/m`. A wrong
dimension is a mistake.

**Expressions.** Wherever a number may stand, text in braces may: `"{a/2 + 5 mm}"`. In it there are numbers with units, the
scene's `parameters`, `+ - * / ^`, parentheses, `pi`, and sin, cos, tan, asin, acos, atan, atan2, sqrt, abs, min, max; nothing
else. Dimensions are checked: lengths are added to lengths, a sine is of an angle, and a length must come out where one is wanted.
A ratio may be an angle, and radians need not be taken out (radius times angle is a length). Parameters are set (`--set
parameters.a=130mm`), swept (`"over": {"parameters.a": "100 mm:200 mm:11"}`), differentiated and fitted like any number; a number
that is set itself follows its expression no longer. They are parameters of [FMUs](../fmu/README.md), too, where these can change
all that follows them. Names of units and functions cannot name a parameter. `0.3 SI` is 0.3 in whatever SI unit is wanted: copies
of plain numbers are written so.

**Placed bodies.** A body with a `position` stands there, turned by its `orientation`, when all joint coordinates are 0. Joints
between placed bodies (and the ground) are found from there: `at` says where the joint is in the world, `axis` and `reference` are
directions of the world. Without `at` it is at the point that one side names, or at the origin of the outboard body. `trunnion
check FILE --plot start.png` draws the assembled start.

**Files and copies.** `include: common.yaml` takes over the keys of a file that the scene does not give itself. An entry of
`assemblies` is a part with names of its own: body `rod` of assembly `leg` is `leg_rod`, its parameter `size` is `leg_size`, and a
name that its `points` give is used as `leg.NAME`. `copies` repeats it: copies are numbered from 1, `leg1_rod`, and inside them
`{i}`, `{i-1}` stand for numbers, in expressions and in names. Copies that are turned or mirrored have placed bodies. In a mirror
image every number keeps its meaning; the two ends of a pin change places. `trunnion check FILE -o whole.yaml` writes the scene
with nothing left to put together, which runs to the same bits; servers, which read no files, take that.
"""


def page_text() -> str:
    """The page as Markdown."""
    schema = json_schema()
    groups = schema.pop("$defs")
    found = examples()
    names = [*(n for n in ORDER if n in groups), *sorted(set(groups) - set(ORDER))]
    return "\n".join([HEAD, *_group("Scene", schema, found), *(line for n in names for line in _group(n, groups[n], found))]) + "\n"


def examples() -> dict[tuple[str, str], str]:
    """For each (group, key) the shortest way in which the example scene gives it."""
    out: dict[tuple[str, str], str] = {}
    schema = json_schema()
    data = read(EXAMPLES.read_bytes()).data
    for group, key, value in _given(data, schema | {"title": "Scene"}, schema["$defs"]):
        text = _shown(value)
        if text and len(text) < len(out.get((group, key), "x" * (LONGEST + 1))):
            out[group, key] = text
    return out | {("Scene", "include"): "common.yaml"}


def _given(value: Any, schema: dict[str, Any], groups: dict[str, Any], name: str = "Scene") -> Iterator[tuple[str, str, Any]]:
    """(group, key, value) of everything in plain data, by the schema's groups."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        schema = groups[name]
    for option in schema.get("anyOf", ()):
        yield from _given(value, option, groups, name)
    if isinstance(value, list) and "items" in schema:
        for v in value:
            yield from _given(v, schema["items"], groups, name)
    if not isinstance(value, dict):
        return
    known = schema.get("properties", {})
    if known and not set(value) <= set(known):
        return
    for key, v in value.items():
        if key in known:
            yield name, key, v
            yield from _given(v, known[key], groups, name)
        elif isinstance(schema.get("additionalProperties"), dict):
            yield from _given(v, schema["additionalProperties"], groups, name)


def _shown(value: Any) -> str:
    """A value as it would stand in a file; what is long is cut to its first entries."""
    text = flow(value)
    if len(text) <= LONGEST:
        return text
    if isinstance(value, dict):
        key, first = next(iter(value.items()))
        inner = flow(first)
        return f"{{{key}: {inner}, …}}" if len(inner) + len(key) < LONGEST - 8 else f"{{{key}: {{…}}, …}}"
    return f"{text[: LONGEST - 1]}…"


def _group(name: str, group: dict[str, Any], found: dict[tuple[str, str], str]) -> list[str]:
    about = "The keys at the top of a file." if name == "Scene" else group["description"]
    lines = [f"## {name}", "", about.replace("``", "`"), ""]
    lines += ["| key | what it is | value | left out | example |", "|---|---|---|---|---|"]
    needed = set(group.get("required", ()))
    for key, p in group["properties"].items():
        what, value = _meaning(p)
        left = "needed" if key in needed or (name == "Scene" and key in ("bodies", "joints")) else _default(p)
        example = found.get((name, key)) or _usual(p)
        lines.append(f"| `{key}` | {_cell(what)} | {_cell(value)} | {left} | {f'`{_cell(example)}`' if example else ''} |")
    return [*lines, ""]


def _usual(p: dict[str, Any]) -> str:
    """An example of what the scene of examples has none of."""
    if said := re.search(r'or text such as "([^"]*)"', str(p)):
        return said[1]
    if "enum" in p:
        return str(p["enum"][-1])
    first = next((o for o in p.get("anyOf", ()) if o != {"type": "null"}), p)
    if first is not p:
        return _usual(first)
    otherwise = "0.3" if "type" in p else "{…}"
    return {"boolean": "true", "integer": "2", "array": "[…]", "string": "NAME"}.get(str(p.get("type")), otherwise)


def _meaning(p: dict[str, Any]) -> tuple[str, str]:
    """(what a key means, what values it takes), where the schema has both in one text."""
    text = re.sub(r"\((?:[^()]|\([^()]*\))*, or text such as \"[^\"]*\"\)", "", p.get("description", "")).replace("``", "`")
    return " ".join(text.split()), _value(p)


def _value(p: dict[str, Any]) -> str:
    """The values a schema takes, in words, with links to groups."""
    if "$ref" in p:
        group = p["$ref"].rsplit("/", 1)[1]
        return f"[{group}](#{group.lower()})"
    if "anyOf" in p:
        return " or ".join(dict.fromkeys(_value(o) for o in p["anyOf"] if o != {"type": "null"}))
    if "enum" in p or "const" in p:
        return ", ".join(f"`{c}`" for c in p.get("enum", [p.get("const")]))
    if p.get("type") == ["number", "string"]:
        said = re.search(r"\((\w[^()]*?)(?: in ([^,]+))?, or text such as", p.get("description", ""))
        unit = f" ({said[2]})" if said and said[2] else ""
        return (said[1] if said else "number") + unit + _range(p)
    if p.get("type") == "array":
        count = f"{p['minItems']} × " if "minItems" in p else ""
        return f"list of {count}{_value(p['items'])}"
    if p.get("type") == "object":
        return f"by name: {_value(p['additionalProperties'])}"
    return {"string": "text", "boolean": "`true`, `false`", "integer": "whole number"}.get(str(p.get("type")), "")


def _range(p: dict[str, Any]) -> str:
    signs = (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"))
    said = [f"{sign} {p[key]:g}" for key, sign in signs if key in p] + (["≠ 0"] if "not" in p else [])
    return f", {', '.join(said)}" if said else ""


def _default(p: dict[str, Any]) -> str:
    return f"`{flow(p['default'])}`" if p.get("default") not in (None, "") else ""


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page_text(), encoding="utf-8")
