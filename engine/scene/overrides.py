"""Changes to single numbers of a scene by dotted path, and the list of all paths of a scene."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cache
from typing import Any

from trunnion.basics.errors import MOST, Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.checks import checked
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.yaml_reader import read
from trunnion.scene.findings.findings_and_paths import dotted
from trunnion.scene.findings.name_suggestions import shown
from trunnion.scene.plain_data_changes import opened, set_values
from trunnion.scene.queries.numbers_by_path import numbers
from trunnion.scene.scene_loader import Source, scene_of, source_of_file
from trunnion.scene.validation import plain_copy


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
    """(path, value) of "PATH=VALUE". The value has the syntax of a scene file: 0.5, 3 deg, [0, 0, -1.62], viscous. Raises
    SceneError when the text has another form."""
    path, sign, value = text.partition("=")
    if not sign or not value.strip():
        raise SceneError([Problem(text, "not of the form PATH=VALUE", "for example joints.ball.friction.mu=0.5")])
    doc = read(value.strip())
    if doc.findings:
        raise SceneError([Problem(path.strip(), f.what, str(f.hint)) for f in doc.findings])
    return path.strip(), doc.data


Given = Scene | str | os.PathLike[str] | Mapping[str, Any]
"""A scene argument of a Python function: a Scene, a file or folder, the name of a bundled model, or the data of a scene file."""


def scene_given(source: Given, changes: Mapping[str, Any] | None = None, massless: bool = False) -> Scene:
    """The checked scene of an argument, after ``changes`` (values by dotted path); ``massless`` as for ``load_scene``.
    SceneError lists all problems."""
    if isinstance(source, Scene):
        return apply(source, changes) if changes else checked(source)
    if not isinstance(source, Mapping | str | os.PathLike):
        what = f"a scene is expected, not {shown(source)}"
        raise SceneError([Problem("scene", what, "a Scene, a dict, a file, or the name of a bundled model")])
    try:
        return scene_of(_read(source), massless, changes)
    except SceneError:
        if not changes:
            raise
    # The scene failed with the changes. ``scene_of`` without the changes reports the scene's own mistakes. If the scene has none,
    # ``apply`` reports the mistakes in the changes.
    return apply(scene_of(_read(source), massless), changes)


def _read(source: str | os.PathLike[str] | Mapping[str, Any]) -> Source:
    return Source(plain_copy(source)) if isinstance(source, Mapping) else source_of_file(source)


def apply(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """The scene with other values at dotted paths, checked again. SceneError lists every wrong path and value."""
    data = opened(scene)
    if wrong := set_values(data, changes):
        every_path = cache(lambda: [p.path for p in list_parameters(scene)])
        raise SceneError([w.problem(every_path) for w in wrong[:MOST]], more=len(wrong[MOST:]))
    return scene_of(Source(data))


def law_changes(scene: Scene, law: str) -> dict[str, str]:
    """The changes that give every frictional joint this law."""
    own = [n for n, j in scene.joints.items() if j.friction is not None and j.friction.law is not None]
    return {"friction.law": law, **{f"joints.{n}.friction.law": law for n in own}}
