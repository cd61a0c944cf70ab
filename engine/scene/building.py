"""From plain data to a Scene, together with every mistake of form. What is broken is set aside, so that the rest can still be
checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

from pydantic import TypeAdapter, ValidationError

from engine.basics.problems import Problem, SceneError
from engine.joints import FREE
from engine.scene.finding import CONNECTIONS, Finding, Path
from engine.scene.model import Scene
from engine.scene.reading import DEEPEST
from engine.scene.scalars import whole_text
from engine.scene.translate import findings_of

ROUNDS = 12
"""Attempts at setting broken parts aside before the rest is given up."""

STUB_BODY = {"mass": 1.0, "inertia": [1.0, 1.0, 1.0]}


@dataclass
class Built:
    """What plain data became. scene: the whole scene, or what is left of it (None when nothing is usable); findings: mistakes
    of form; broken: paths of the parts that were set aside (CONNECTIONS among them when whole joints are missing)."""

    scene: Scene | None
    findings: list[Finding] = field(default_factory=list)
    broken: set[Path] = field(default_factory=set)

    def hides(self, f: Finding) -> bool:
        """Whether a finding may be no more than a consequence of what was set aside: it lies in a broken part, or depends on one,
        or on something that has a broken part."""
        return any(self._broken_around(p) for p in (f.path, *f.about)) or not self._around_broken.isdisjoint(f.about)

    def _broken_around(self, path: Path) -> bool:
        return any(path[:n] in self.broken for n in range(len(path) + 1))

    @cached_property
    def _around_broken(self) -> set[Path]:
        """The paths of all parts that have something broken inside them."""
        return {b[:n] for b in self.broken for n in range(len(b))}


@cache
def _adapter() -> TypeAdapter[Scene]:
    return TypeAdapter(Scene)


def build(data: Any) -> Built:
    """Validate plain data; when there are mistakes, try again without the broken parts."""
    try:
        return Built(_adapter().validate_python(data))
    except ValidationError as e:
        errors = [dict(x) for x in e.errors(include_url=False)]
    built = Built(None, findings_of(errors, data))
    if not isinstance(data, dict):
        return built
    rest = copied(data)
    for _ in range(ROUNDS):
        _mend(rest, findings_of(errors, rest), built)
        try:
            built.scene = _adapter().validate_python(rest)
        except ValidationError as e:
            errors = [dict(x) for x in e.errors(include_url=False)]
        else:
            break
    return built


def _mend(rest: dict[str, Any], found: list[Finding], built: Built) -> None:
    """Leave out the parts that the findings are about. Once a part is gone, later findings inside it take nothing more away:
    the hundredth wrong entry of a list removes no more than the first."""
    gone: set[Path] = set()
    for f in found:
        if any(f.path[:n] in gone for n in range(len(f.path) + 1)):
            continue
        gone.add(_set_aside(rest, f.path, built) if f.meant is None else _forget(rest, f.path, f.meant, built))


def copied(data: Any, deeper: int = DEEPEST) -> Any:
    """A copy made of nested dicts (keys as text) and lists. SceneError when they are nested too deep, or contain themselves."""
    if isinstance(data, dict | Mapping):
        inside = _within(data, deeper)
        return {whole_text(str(k)): copied(v, inside) for k, v in data.items()}
    if isinstance(data, list | tuple):
        inside = _within(data, deeper)
        return [copied(v, inside) for v in data]
    return whole_text(data) if isinstance(data, str) else data


def _within(data: Any, deeper: int) -> int:
    """How many more levels may follow inside; SceneError when there are no more."""
    if deeper <= 0:
        raise SceneError([Problem("scene", f"more than {DEEPEST} levels of nesting", "a scene needs no more than ten")])
    return deeper - 1


def _set_aside(data: dict[str, Any], path: Path, built: Built) -> Path:
    """Remove the smallest part around a mistake that can be left out, and give its path; a body or joint that cannot be mended
    otherwise shrinks to a stub."""
    node, at = _deepest_group(data, path)
    if len(at) <= 1:  # the mistake is in one of the scene's own keys
        key = path[0] if path else ""
        required = key in ("bodies", "joints")
        data.pop(str(key), None)
        if required:
            data[str(key)] = {}
            built.broken.add(CONNECTIONS)
        built.broken.add(path[:1])
        return path[:1]
    if len(at) == 2:
        _stub(data, (str(at[0]), str(at[1])), built)
        return at
    del node[str(at[-1])]
    built.broken.add(at)
    return at


def _forget(data: dict[str, Any], path: Path, meant: str, built: Built) -> Path:
    """Remove an unknown key and give its path. The key it was meant to be counts as broken."""
    node, at = _deepest_group(data, path)
    if at == path:
        del node[str(at[-1])]
    built.broken.add((*path[:-1], meant) if meant else path)
    return path


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
            data[section][name] = {"type": FREE.name, **ends}


def _body_of(side: Any) -> str | None:
    body = side.get("body") if isinstance(side, dict) else side
    return body.partition(".")[0] if isinstance(body, str) else None
