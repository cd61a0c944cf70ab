"""``reference/scene_keys*.md``: every key of a scene with meaning, values, unit, default and example, from the declarations.

Meanings, values and defaults are those of the JSON Schema. The example of a key is the shortest value that the scene of examples
gives to the key. A number of a friction law that this scene does not use has the example of its declaration.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, is_dataclass
from functools import cache
from pathlib import Path as FilePath
from typing import Any

from trunnion.elements import friction
from trunnion.scene.file_format import json_schema
from trunnion.scene.file_format.yaml_reader import read
from trunnion.scene.file_format.yaml_writer import flow
from trunnion.scene.findings.findings_and_paths import Path
from trunnion.scene.force_laws.registry import REGISTRY as FORCE_LAWS
from trunnion.scene.signals.registry import REGISTRY as SIGNALS

CURVES = [law.data for law in FORCE_LAWS.values() if is_dataclass(law.data)]
"""Groups of keys of nonlinear springs and dampers."""
EXAMPLES = FilePath(json_schema.__file__).with_name("key_examples")
"""Folder of the scene of examples and of the files that it names."""
RUBS: Path = ("joints", "axle", "friction")
"""Place of a friction in the scene of examples. A number of any law may stand at this place."""
LONGEST = 110
"""Largest number of characters of an example."""
PAGES = {
    "scene_keys": ("Scene keys", "Scene", "Simulation", "RealTime", "Input", "Ground", "FrictionDefaults"),
    "scene_keys_bodies_joints": (
        "Scene keys: bodies and joints", "Body", "Cylinder", "AxialInertia", "Turn", "Joint", "Side", "Friction", "Wear", "Start",
        "AxisAngle", "Spring", "Nonlinear", *(x.__name__ for x in CURVES), "EndStops", "Latch", "Motor", "Mimic", "Profile",
        "Curve", "Slot", "Unilateral",
    ),
    "scene_keys_loads_signals": (
        "Scene keys: loads, drives and signals", "Force", "Torque", "SpringDamper", "Bushing", "Drag", "PointGravity", "Field",
        "PlaceFormula", "Drive", "Signal",
        *(kind.data.__name__ for kind in SIGNALS.values()), "Limit", "FromInput", "InputCurve", "BySpeed", "ByLoad",
    ),
    "scene_keys_assemblies": ("Scene keys: assemblies", "Assembly", "Part", "Copies", "Mirror", "Rotate", "Line"),
}  # fmt: skip
"""Page → its title and its groups of keys, in the order in which a reader needs them."""
HEAD = """
A scene is a YAML or JSON file. `trunnion new NAME` writes a scene to start from. `trunnion check FILE` lists all mistakes at
once. Editors read the same keys from the [JSON Schema](scene.schema.json). The examples are from one
[scene](../../scene/file_format/key_examples/scene.yaml). Other keys: [bodies and joints](scene_keys_bodies_joints.md), [loads,
drives and signals](scene_keys_loads_signals.md), [assemblies](scene_keys_assemblies.md).

**Numbers** are SI: m, kg, s, rad, N. Text with a unit is converted: `30 mm`, `45 deg`, `60 rpm`, `7.8 g/cm^3`, `2 kN/m`. A unit
of another dimension is refused. `0.3 SI` is 0.3 in the SI unit of the key.

**Expressions** are text in braces: `"{a/2 + 5 mm}"`. An expression may replace any number. It contains:

* numbers with units, and names of the scene's `parameters`;
* `+ - * / ^` and parentheses;
* `pi`, sin, cos, tan, asin, acos, atan, atan2, sqrt, exp, log, tanh, abs, min, max.

Trunnion checks dimensions: only lengths add to a length, and a sine needs an angle. A ratio may be an angle, and radius times angle
is a length. Names of units and functions cannot name a parameter. Parameters are set, varied, differentiated and fitted like any
number: `--set parameters.a=130mm`, `"vary": {"parameters.a": "100 mm:200 mm:11"}`. A number that is set no longer follows its
expression. [FMUs](../../../fmu/README.md) have a parameter if they can change all numbers that depend on it.

**Placed bodies** have a `position`. When all joint coordinates are 0, the body is at this position, turned by its `orientation`.
Between placed bodies (and the ground), the key `at` of a joint is a place in the world. `axis` and `reference` are then
directions of the world. Without `at`, the joint is at the point that one side names, or at the origin of the outboard body.
`trunnion check FILE --plot start.png` draws the assembled start.

**Files.** `include: shared_keys.yaml` adds the keys of another file that the scene itself lacks. `trunnion check FILE -o
whole.yaml` writes the scene without includes and assemblies; its results are the same, bit for bit. Servers read no files and need
this form.
"""
HEADS = {
    "scene_keys": HEAD,
    "scene_keys_assemblies": """
An entry of `assemblies` is a part with names of its own. Body `rod` of assembly `leg` is `leg_rod`; its parameter `size` is
`leg_size`. A name under `points` of the part is `leg.NAME` outside.

`copies` repeats the part. Copies are numbered from 1: `leg1_rod`. In expressions and names of a copy, `{i}` and `{i-1}` are
numbers. Bodies of turned or mirrored copies must be placed. A mirror image keeps all numbers; the two ends of a pin change places.
""",
}
"""Texts before the tables of a page."""


@dataclass(frozen=True)
class Example:
    """The example of a key. path: place of the value in the scene of examples; named: whether the value has entries by name, and
    the example is one of them; beside: other keys at the same place that the value requires."""

    path: Path
    value: Any
    named: bool
    beside: dict[str, Any] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """The value as it stands in a file, without quotes that YAML does not need."""
        quoted = flow(self.value)
        bare = re.sub(r'"([\w.][^"{}\[\],:#]*|-\d[^"{}\[\],:#]*)"', r"\1", quoted)
        return bare if read(f"a: {bare}").data == {"a": self.value} else quoted


def page_text(page: str) -> str:
    """The text of a page."""
    title, *groups = PAGES[page]
    return f"# {title}\n{HEADS.get(page, '')}" + "".join(_section(name) for name in groups)


@cache
def groups_of_keys() -> dict[str, dict[str, Any]]:
    """The schema of every group of keys, by name. ``Scene`` is the group of the whole file."""
    schema = json_schema.json_schema()
    return {"Scene": schema, **schema.pop("$defs")}


@cache
def examples() -> dict[tuple[str, str], Example]:
    """(group, key) → the shortest value of the scene of examples. For numbers of laws that this scene does not use, the declared
    example."""
    out: dict[tuple[str, str], Example] = {}
    for file in ("scene.yaml", "shared_keys.yaml"):
        for group, key, example in _given(read((EXAMPLES / file).read_bytes()).data, groups_of_keys()["Scene"], (), "Scene"):
            if (group, key) not in out or len(example.text) < len(out[group, key].text):
                out[group, key] = example
    return dict(_declared()) | out


def _declared() -> Iterator[tuple[tuple[str, str], Example]]:
    """(group, key), example of every number of a friction law, at a joint of the scene of examples."""
    for name, law in friction.REGISTRY.items():
        values = {n.name: read(f"a: {n.example}").data["a"] for n in law.numbers}
        for n in law.numbers:
            yield ("Friction", n.name), Example((*RUBS, n.name), values[n.name], False, values | {"law": name})
            if n.default is not None:
                yield ("FrictionDefaults", n.name), Example(("friction", n.name), values[n.name], False)


def _given(value: Any, schema: dict[str, Any], path: Path, name: str) -> Iterator[tuple[str, str, Example]]:
    """(group, key, example) of everything in plain data, by the groups of the schema."""
    if "$ref" in schema:
        name = _group_of(schema)
        schema = groups_of_keys()[name]
    for option in schema.get("anyOf", ()):
        yield from _given(value, option, path, name)
    if isinstance(value, list) and "items" in schema:
        for i, v in enumerate(value):
            yield from _given(v, schema["items"], (*path, i), name)
    if not isinstance(value, dict):
        return
    known = schema.get("properties", {})
    if known and not set(value) <= set(known):
        return
    entries = schema.get("additionalProperties")
    for key, v in value.items():
        if key in known:
            named = isinstance(known[key].get("additionalProperties"), dict)
            for one in [{n: e} for n, e in v.items()] if named else [v]:
                yield name, key, Example((*path, key), one, named)
            yield from _given(v, known[key], (*path, key), name)
        elif isinstance(entries, dict):
            yield from _given(v, entries, (*path, key), name)


def _section(name: str) -> str:
    group = groups_of_keys()[name]
    about = "The keys at the top of a file." if name == "Scene" else group["description"].replace("``", "`")
    required = {"bodies", "joints"} if name == "Scene" else set(group["required"])
    rows = (_row(name, key, p, key in required) for key, p in group["properties"].items())
    return f"\n## {name}\n\n{about}\n\n| key | meaning | value | default | example |\n|---|---|---|---|---|\n{''.join(rows)}"


def _row(group: str, key: str, p: dict[str, Any], required: bool) -> str:
    default = "required" if required else f"`{flow(p['default'])}`" if p.get("default") not in (None, "") else "none"
    cells = (f"`{key}`", _meaning(p), _value(p), default, f"`{examples()[group, key].text}`")
    return f"| {' | '.join(c.replace('|', chr(92) + '|') for c in cells)} |\n"


def _meaning(p: dict[str, Any]) -> str:
    """The meaning of a key. The schema's text also states the values of the key; they are removed."""
    text = re.sub(r"\((?:[^()]|\([^()]*\))*, or text such as \"[^\"]*\"\)", "", p["description"]).replace("``", "`")
    return " ".join(text.split())


def _value(p: dict[str, Any]) -> str:
    """The values a schema takes, in words, with links to groups."""
    if "$ref" in p:
        group = _group_of(p)
        page = next(page for page, groups in PAGES.items() if group in groups)
        return f"[{group}]({page}.md#{group.lower()})"
    if "anyOf" in p:
        return " or ".join(dict.fromkeys(_value(o) for o in p["anyOf"] if o != {"type": "null"}))
    if "enum" in p or "const" in p:
        return ", ".join(f"`{c}`" for c in p.get("enum", [p.get("const")]))
    if p["type"] == ["number", "string"]:
        said = re.search(r"\((\w[^()]*?)(?: in ([^,]+))?, or text such as", p.get("description", ""))
        unit = f" ({said[2]})" if said and said[2] else ""
        return (said[1] if said else "number") + unit + _range(p)
    if p["type"] == "array":
        count = f"{p['minItems']} × " if "minItems" in p else ""
        return f"list of {count}{_value(p['items'])}"
    if p["type"] == "object":
        return f"by name: {_value(p['additionalProperties'])}"
    return {"string": "text", "boolean": "`true`, `false`", "integer": "whole number"}[p["type"]]


def _group_of(p: dict[str, Any]) -> str:
    return str(p["$ref"]).rsplit("/", 1)[1]


def _range(p: dict[str, Any]) -> str:
    signs = (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"))
    said = [f"{sign} {p[key]:g}" for key, sign in signs if key in p] + (["≠ 0"] if "not" in p else [])
    return f", {', '.join(said)}" if said else ""
