"""Plain data → Scene, together with every mistake of form; what is broken is set aside so that the rest can still be
checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from engine.scene.finding import CONNECTIONS, Finding, Path
from engine.scene.model import Scene
from engine.scene.translate import findings_of

ROUNDS = 12
"""Attempts at setting broken parts aside before the rest is given up."""

STUB_BODY = {"mass": 1.0, "inertia": [1.0, 1.0, 1.0]}


@dataclass
class Built:
    """scene: the whole, or what is left of it (None: nothing usable); findings: mistakes of form; broken: paths set
    aside (CONNECTIONS among them when whole joints are missing)."""

    scene: Scene | None
    findings: list[Finding] = field(default_factory=list)
    broken: set[Path] = field(default_factory=set)

    def hides(self, f: Finding) -> bool:
        """Whether a finding may be no more than a consequence of what was set aside."""
        return any(f.path[: len(b)] == b or any(a[: len(b)] == b or b[: len(a)] == a for a in f.about) for b in self.broken)


@cache
def _adapter() -> TypeAdapter[Scene]:
    return TypeAdapter(Scene)


def build(data: Any) -> Built:
    """Validate; on mistakes try again without the broken parts."""
    try:
        return Built(_adapter().validate_python(data))
    except ValidationError as e:
        errors = [dict(x) for x in e.errors(include_url=False)]
    built = Built(None, findings_of(errors, data))
    if not isinstance(data, dict):
        return built
    rest = copied(data)
    for _ in range(ROUNDS):
        for f in findings_of(errors, rest):
            if f.meant is None:
                _set_aside(rest, f.path, built)
            else:
                _forget(rest, f.path, f.meant, built)
        try:
            built.scene = _adapter().validate_python(rest)
        except ValidationError as e:
            errors = [dict(x) for x in e.errors(include_url=False)]
        else:
            break
    return built


def copied(data: Any) -> Any:
    """Nested dicts and lists of their own, with text for keys."""
    if isinstance(data, Mapping):
        return {str(k): copied(v) for k, v in data.items()}
    return [copied(v) for v in data] if isinstance(data, list | tuple) else data


def _set_aside(data: dict[str, Any], path: Path, built: Built) -> None:
    """Remove the smallest part around a mistake that can be left out; bodies and joints shrink to a stub at last."""
    node, at = _deepest_group(data, path)
    if len(at) <= 1:  # a mistake in the scene's own keys
        key = path[0] if path else ""
        required = key in ("bodies", "joints")
        data.pop(str(key), None)
        if required:
            data[str(key)] = {}
            built.broken.add(CONNECTIONS)
        built.broken.add(path[:1])
        return
    if len(at) == 2:
        _stub(data, (str(at[0]), str(at[1])), built)
        return
    del node[str(at[-1])]
    built.broken.add(at)


def _forget(data: dict[str, Any], path: Path, meant: str, built: Built) -> None:
    """Remove an unknown key; what it was meant to be counts as broken."""
    node, at = _deepest_group(data, path)
    if at == path:
        del node[str(at[-1])]
    built.broken.add((*path[:-1], meant) if meant else path)


def _deepest_group(data: dict[str, Any], path: Path) -> tuple[dict[str, Any], Path]:
    """The innermost group that has the mistake below one of its keys, and the path of that key."""
    node: Any = data
    group, end = data, 0
    for i, key in enumerate(path):
        if isinstance(node, dict) and key in node:
            group, end = node, i + 1
            node = node[key]
        elif isinstance(node, list) and isinstance(key, int) and key < len(node):
            node = node[key]
        else:
            break
    return group, path[:end]


def _stub(data: dict[str, Any], path: tuple[str, str], built: Built) -> None:
    """Replace a body by one without mistakes, a joint by one that still connects; remove anything else."""
    section, name = path
    old = data[section].pop(name)
    known = old if isinstance(old, dict) else {}
    built.broken.add(path)
    if section == "bodies":
        points = known.get("points")
        names = points if isinstance(points, dict) else {}
        data[section][name] = {**STUB_BODY, "points": {k: [0.0, 0.0, 0.0] for k in names}}
    elif section == "inputs":
        data[section][name] = {}
    elif section == "joints":
        ends = {k: _body_of(known.get(k)) for k in ("inboard", "outboard")}
        if None in ends.values():
            built.broken.add(CONNECTIONS)
        else:
            data[section][name] = {"type": "free", **ends}


def _body_of(side: Any) -> str | None:
    body = side.get("body") if isinstance(side, dict) else side
    return body.partition(".")[0] if isinstance(body, str) else None
