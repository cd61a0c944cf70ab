"""Loading of checked scenes from files, text and dicts. One error reports all problems, each with file, line, path and hint.

The functions ``source_of_…`` read data. ``scene_of`` then applies composition, changed values, expressions, types and checks.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path as FilePath
from typing import Any

from trunnion.basics.errors import SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.composition.whole_scene import compose
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.parameter_evaluation import MEND_FIRST, evaluate
from trunnion.scene.file_format.yaml_reader import read
from trunnion.scene.findings.findings_and_paths import Finding, Path, error_of
from trunnion.scene.library.model_folders import SCENE_FILE
from trunnion.scene.library.scene_files import content_of, scene_file
from trunnion.scene.plain_data_changes import set_values
from trunnion.scene.validation import build, plain_copy


@dataclass
class Source:
    """The data of a scene as read. ``findings`` are problems of the reader; ``lines`` maps each path to its line. ``folder`` is
    the folder of the files that the scene names, or None if files must not be read."""

    data: dict[str, Any]
    findings: list[Finding] = field(default_factory=list)
    lines: dict[Path, int] = field(default_factory=dict)
    file: str = ""
    folder: FilePath | None = None


def load_scene(source: str | os.PathLike[str], massless: bool = False) -> Scene:
    """Read a scene.

    Args:
        source: a YAML or JSON file, a folder with a ``scene.yaml``, or the name of a bundled model.
        massless: whether bodies may lack masses. They then get a mass of 1 kg, for analyses that do not depend on masses.

    Returns:
        The checked scene, numbers in SI units.

    Raises:
        SceneError: with every problem of the scene.
    """
    return scene_of(source_of_file(source), massless)


def source_of_file(source: str | os.PathLike[str]) -> Source:
    """The content of a scene file; ``source`` as for ``load_scene``. Raises SceneError when the file cannot be read as scene
    data."""
    path = scene_file(source)
    return source_of_content(content_of(path), path)


def source_of_content(content: bytes, path: FilePath) -> Source:
    """The data in the bytes of a scene file."""
    name = path.parent.name if path.name == SCENE_FILE else path.stem
    return source_of_text(content, str(path), path.suffix.lower() == ".json", name, path.parent)


def scene_from_text(
    content: bytes | str, file: str = "", is_json: bool = False, name: str = "", folder: FilePath | None = None
) -> Scene:
    """The scene in YAML (or JSON) text. ``name`` is used if the text has no name. ``folder`` is the folder of the files that the
    text names; without a folder, such files are refused."""
    return scene_of(source_of_text(content, file, is_json, name, folder))


def source_of_text(content: bytes | str, file: str, is_json: bool, name: str, folder: FilePath | None) -> Source:
    """The data in a text, with arguments as for ``scene_from_text``. Raises SceneError when the text is not a group of keys."""
    doc = read(content, is_json)
    if doc.data is None and not doc.findings:
        doc.findings.append(Finding((), "the file is empty", "a scene has bodies and joints"))
    if not isinstance(doc.data, dict):
        if doc.data is not None:
            doc.findings.append(Finding((), "a scene is a group of keys", "begin with bodies: and joints:", 1))
        raise error_of(doc.findings, doc.lines, file)
    if name and "name" not in doc.data:
        doc.data["name"] = name
    return Source(doc.data, doc.findings, doc.lines, file, folder)


def scene_from_dict(data: Mapping[str, Any], massless: bool = False) -> Scene:
    """Read a scene from plain data.

    Args:
        data: nested dicts and lists, as in a file.
        massless: as for ``load_scene``.

    Returns:
        The checked scene, numbers in SI units.

    Raises:
        SceneError: with every problem of the scene.
    """
    return scene_of(Source(plain_copy(data)), massless)


def _add_masses(data: dict[str, Any]) -> None:
    """Give every body without mass and density a mass of 1 kg. A body with neither shape nor inertia also gets an inertia."""
    bodies = data.get("bodies")
    for body in bodies.values() if isinstance(bodies, dict) else ():
        if isinstance(body, dict) and not {"mass", "density"} & set(body):
            body["mass"] = 1.0
            if not {"box", "cylinder", "sphere", "inertia"} & set(body):
                body["inertia"] = [1.0, 1.0, 1.0]


def scene_of(source: Source, massless: bool = False, changes: Mapping[str, Any] | None = None) -> Scene:
    """The checked scene of a source; ``massless`` as for ``load_scene``. ``changes`` are values by dotted path, which are set
    before expressions are evaluated.

    The function modifies the source's data. SceneError lists all problems in the order of the file.
    """
    data, lines, composed = compose(source.data, source.lines, source.file, source.folder)
    if changes and (wrong_paths := set_values(data, changes)):
        raise SceneError([w.problem() for w in wrong_paths])
    data, wrong = evaluate(data)
    if massless:
        _add_masses(data)
    built = build(data)
    told = {f.path for f in composed}
    found = [*source.findings, *composed, *wrong, *(f for f in built.findings if f.hint != MEND_FIRST and f.path not in told)]
    # After a mistake in composition, parts are missing, and the checks would report many consequences.
    if not composed:
        found += built.scene_findings()
    if found or built.scene is None:
        raise error_of(found, lines, source.file)
    return built.scene
