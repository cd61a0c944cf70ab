"""Validation of plain data against the scene's classes. Invalid parts are removed, so that the checks can run on the rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import LOCK, dataclass
from trunnion.elements.joints import FREE, REGISTRY, REVOLUTE
from trunnion.scene.checks import findings
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.yaml_reader import DEEPEST
from trunnion.scene.file_format.yaml_scalars import whole_text
from trunnion.scene.findings.findings_and_paths import CONNECTIONS, Finding, Path
from trunnion.scene.findings.name_suggestions import closest
from trunnion.scene.validation_messages import findings_of

if TYPE_CHECKING:
    from pydantic import TypeAdapter

ROUNDS = 12
"""Largest number of attempts to remove invalid parts. If all attempts fail, no scene is built."""

STAND_INS = (REVOLUTE.name, FREE.name)
"""Types that the checks assume for a joint of unknown type."""

STUB_BODY = {"mass": 1.0, "inertia": [1.0, 1.0, 1.0]}


@dataclass
class Built:
    """A scene built from plain data without its invalid parts.

    scene     None when no valid scene remains
    findings  mistakes of form: unknown keys, wrong types, missing keys, wrong units
    broken    paths of the removed parts, with CONNECTIONS if whole joints were removed
    untyped   paths of joints whose type is unknown and not similar to a known type
    """

    scene: Scene | None
    findings: list[Finding] = field(default_factory=list)
    broken: set[Path] = field(default_factory=set)
    untyped: set[Path] = field(default_factory=set)

    def scene_findings(self) -> list[Finding]:
        """The findings of the checks on the scene, without those that a removed part may have caused. A finding about an untyped
        joint counts only if the checks report it for each type in ``STAND_INS``."""
        if self.scene is None:
            return []
        found = [f for f in findings(self.scene) if not self.hides(f)]
        if not self.untyped:
            return found
        joints = self.scene.joints
        retyped = {str(name): replace(joints[str(name)], type=STAND_INS[1]) for _, name in self.untyped if name in joints}
        others = set(findings(replace(self.scene, joints={**joints, **retyped})))
        return [f for f in found if f.path[:2] not in self.untyped or f in others]

    def hides(self, f: Finding) -> bool:
        """Whether a removed part may have caused a finding. A removed part counts if it contains the finding's path or a path in
        ``about``. A part inside a path in ``about`` also counts."""
        return any(self._broken_around(p) for p in (f.path, *f.about)) or not self._around_broken.isdisjoint(f.about)

    def _broken_around(self, path: Path) -> bool:
        return any(path[:n] in self.broken for n in range(len(path) + 1))

    @cached_property
    def _around_broken(self) -> set[Path]:
        """The paths of all parts that contain a removed part."""
        return {b[:n] for b in self.broken for n in range(len(b))}


@cache
def _adapter() -> TypeAdapter[Scene]:
    from pydantic import TypeAdapter

    return TypeAdapter(Scene)


def _validated(data: Any) -> Scene:
    with LOCK:
        return _adapter().validate_python(data)


def build(data: Any) -> Built:
    """Validate plain data; when there are mistakes, validate again without the invalid parts."""
    from pydantic import ValidationError

    try:
        return Built(_validated(data))
    except ValidationError as e:
        errors = [dict(x) for x in e.errors(include_url=False)]
    built = Built(None, findings_of(errors, data))
    if not isinstance(data, dict):
        return built
    rest = plain_copy(data)
    for _ in range(ROUNDS):
        _remove_broken(rest, findings_of(errors, rest), built)
        try:
            built.scene = _validated(rest)
        except ValidationError as e:
            errors = [dict(x) for x in e.errors(include_url=False)]
        else:
            break
    return built


def _remove_broken(rest: dict[str, Any], found: list[Finding], built: Built) -> None:
    """Remove the parts with findings. Further findings in a removed part are skipped: a hundred wrong entries of a list remove the
    same part as one wrong entry."""
    gone: set[Path] = set()
    for f in found:
        if any(f.path[:n] in gone for n in range(len(f.path) + 1)):
            continue
        gone.add(_remove_part(rest, f.path, built) if f.meant is None else _remove_unknown_key(rest, f.path, f.meant, built))


def plain_copy(data: Any, deeper: int = DEEPEST) -> Any:
    """A copy as nested dicts (keys as text) and lists. Raises SceneError when the nesting is too deep, for example cyclic."""
    if isinstance(data, dict | Mapping):
        inside = _next_level(deeper)
        return {whole_text(str(k)): plain_copy(v, inside) for k, v in data.items()}
    if isinstance(data, list | tuple):
        inside = _next_level(deeper)
        return [plain_copy(v, inside) for v in data]
    return whole_text(data) if isinstance(data, str) else data


def _next_level(deeper: int) -> int:
    """The number of nesting levels that are still allowed inside. Raises SceneError when no level is left."""
    if deeper <= 0:
        raise SceneError([Problem("scene", f"more than {DEEPEST} levels of nesting", "a scene needs no more than ten")])
    return deeper - 1


def _remove_part(data: dict[str, Any], path: Path, built: Built) -> Path:
    """Remove the smallest optional part that contains a mistake. Returns the path of this part. A valid stub replaces a whole body
    or joint."""
    node, at = _deepest_group(data, path)
    if len(path) == 3 and (path[0], path[2]) == ("joints", "type"):
        joint = data["joints"][path[1]]
        similar = closest(str(joint.get("type", "")), REGISTRY)
        if not similar:
            built.untyped.add(path[:2])
        joint["type"] = similar or STAND_INS[0]
        built.broken.add(path)
        return path
    if len(at) <= 1:  # a mistake in a top-level key of the scene
        key = path[0] if path else ""
        required = key in ("bodies", "joints")
        data.pop(str(key), None)
        if required:
            data[str(key)] = {}
            built.broken.add(CONNECTIONS)
        built.broken.add(path[:1])
        return path[:1]
    if len(at) == 2:
        _replace_by_stub(data, (str(at[0]), str(at[1])), built)
        return at
    del node[str(at[-1])]
    built.broken.add(at)
    return at


def _remove_unknown_key(data: dict[str, Any], path: Path, meant: str, built: Built) -> Path:
    """Remove an unknown key; the result is its path. The key ``meant`` also counts as removed."""
    node, at = _deepest_group(data, path)
    if at == path:
        del node[str(at[-1])]
    built.broken.add((*path[:-1], meant) if meant else path)
    return path


def _deepest_group(data: dict[str, Any], path: Path) -> tuple[dict[str, Any], Path]:
    """The innermost group on the way to ``path``, and the path of the key in this group that leads to the mistake."""
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


def _replace_by_stub(data: dict[str, Any], path: tuple[str, str], built: Built) -> None:
    """Replace a body or input by a valid body or input, and a joint by a free joint between the same bodies. Remove any other
    part."""
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
