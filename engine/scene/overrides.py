"""Changes to single numbers of a scene by dotted path, and the list of the paths that a scene has."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from typing import Any

from engine.basics.problems import MOST, Problem, SceneError
from engine.scene.check import checked
from engine.scene.contexts import numbers
from engine.scene.dimensions import unit_of
from engine.scene.finding import Finding, Path, dotted, parse_path
from engine.scene.load import load_scene, scene_from_data, scene_from_dict
from engine.scene.model import Scene
from engine.scene.quantities import Computed, Quantity, Worthless, agree, number
from engine.scene.reading import read
from engine.scene.suggest import Nearest, closest, shown
from engine.scene.typed import keys_at
from engine.scene.units import UnitError
from engine.scene.written.parameters import is_expression


@dataclass(frozen=True)
class Parameter:
    """A number of a scene: dotted path (indices from 1), SI value, SI unit."""

    path: str
    value: float
    unit: str


def list_parameters(scene: Scene) -> list[Parameter]:
    """Every number of a scene, defaults included, in the scene's order."""
    return [Parameter(dotted(path), float(value), unit) for path, value, unit in numbers(scene)]


def parse_assignment(text: str) -> tuple[str, Any]:
    """(path, value) of "PATH=VALUE". The value is read as in a scene file: 0.5, 3 deg, [0, 0, -1.62], viscous. SceneError when
    the text has another form."""
    path, sign, value = text.partition("=")
    if not sign or not value.strip():
        raise SceneError([Problem(text, "not of the form PATH=VALUE", "for example joints.ball.friction.mu=0.5")])
    doc = read(value.strip())
    if doc.findings:
        raise SceneError([Problem(path.strip(), f.what, str(f.hint)) for f in doc.findings])
    return path.strip(), doc.data


Given = Scene | str | os.PathLike[str] | Mapping[str, Any]
"""What a caller from Python gives for a scene: made by hand, a file or folder, a bundled model's name, what a file would hold."""


def scene_given(source: Given, changes: Mapping[str, Any] | None = None, massless: bool = False) -> Scene:
    """The checked scene that a caller means, with ``changes`` made; massless: as for ``load_scene``.
    SceneError names everything that is wrong with it."""
    if isinstance(source, Mapping):
        scene = scene_from_dict(source, massless)
    elif isinstance(source, Scene):
        scene = source if changes else checked(source)
    elif isinstance(source, str | os.PathLike):
        scene = load_scene(source, massless)
    else:
        what = f"a scene is wanted, not {shown(source)}"
        raise SceneError([Problem("scene", what, "a Scene, a dict, a file, or the name of a bundled model")])
    return apply(scene, changes) if changes else scene


def apply(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """The scene with other values at dotted paths, checked again. SceneError names every path and value that is wrong."""
    data = _opened(scene)
    wrong = [w for path, value in changes.items() if (w := _set(data, path, _measured(scene, path, value)))]
    if wrong:
        whole = cache(lambda: [p.path for p in list_parameters(scene)])
        raise SceneError([Problem(w.text, w.what, _hint(w, whole)) for w in wrong[:MOST]], more=len(wrong[MOST:]))
    return scene_from_data(data)


@dataclass(frozen=True)
class _Wrong:
    """A path that leads nowhere: the path as written, why it does, and which path may be meant."""

    text: str
    what: str
    hint: str | Nearest = ""


def _opened(value: Any) -> Any:
    """Nested dicts and lists of a scene with all its fields, also those without a value."""
    if is_dataclass(value):
        return {f.name: _opened(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, dict):
        return {k: _opened(v) for k, v in value.items()}
    if isinstance(value, Computed) and value.names:
        return value.text  # its parameters may be among the changes
    return [_opened(v) for v in value] if isinstance(value, tuple) else value


def _set(data: Any, text: str, value: Any) -> _Wrong | None:
    """Put a value in its place in nested data; gives what is wrong when there is no such place."""
    path = parse_path(text)
    if path is None:
        return _Wrong(text, "not a path", "paths look like joints.ball.friction.mu or gravity[3]")
    node = data
    for i, key in enumerate(path):
        last = i == len(path) - 1
        found = _missing(node, path[: i + 1])
        if found:
            return _Wrong(text, found.what, found.hint)
        if last:
            node[key] = value
        elif isinstance(node[key], int | float) and path[i + 1 :] == (0,):
            node[key] = value  # a joint with one coordinate may give a number for its list: then q[1] means that number
            break
        else:
            if node[key] is None:
                node[key] = {}
            node = node[key]
    return None


def _measured(scene: Scene, path: str, value: Any) -> Any:
    """The value as it is to be set: a plain number given to a parameter is measured as the parameter is, in SI."""
    steps = parse_path(path) or ()
    old = scene.parameters.get(str(steps[1])) if len(steps) == 2 and steps[0] == "parameters" else None
    if not isinstance(old, Quantity) or is_expression(value):
        return value
    try:
        new = number(value)
        if isinstance(new, Quantity):
            agree(new, unit_of(old.dimension) or "1")
    except UnitError as e:
        return Worthless(str(value), e.what, e.hint)
    return Quantity(new, old.dimension, new.text if isinstance(new, Quantity) else f"{new!r} {unit_of(old.dimension)}")


def _missing(node: Any, path: Path) -> Finding | None:
    """Why the last step of ``path``, taken at ``node``, leads nowhere; None when it leads somewhere."""
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


def _hint(wrong: _Wrong, whole: Callable[[], list[str]]) -> str:
    """The hint for the step that failed; when it names nothing close, the path among ``whole`` (all numbers) that is close."""
    hint = str(wrong.hint)
    if hint.startswith("known"):
        near = next((p for p in whole() if p.endswith(f".{wrong.text}")), "") or closest(wrong.text, whole())
        return f'did you mean "{near}"?' if near else hint
    return hint
