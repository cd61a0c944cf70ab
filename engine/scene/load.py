"""From files, text and dicts to checked scenes. All problems are told at once, each with file, line, path and hint."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any

from engine.basics.problems import Problem, SceneError
from engine.scene.building import build, copied
from engine.scene.check import findings
from engine.scene.finding import Finding, Path, error_of
from engine.scene.library import SCENE_FILE, bundled_names, model_file
from engine.scene.model import Scene
from engine.scene.reading import LARGEST, read
from engine.scene.written.composing import whole
from engine.scene.written.parameters import MEND_FIRST, evaluated

SUFFIXES = (".yaml", ".yml", ".json")
MOST_NAMED = 5
"""How many files of a folder a hint names."""


def load_scene(source: str | os.PathLike[str], massless: bool = False) -> Scene:
    """The scene in a YAML or JSON file, in a folder with a scene.yaml, or the bundled model of that name; massless: bodies need no
    mass (they are given some: for questions in which it does not count).

    SceneError holds every problem found; nothing else is raised for bad content.
    """
    path = _file(source)
    try:
        with path.open("rb") as f:
            content = f.read(LARGEST + 1)  # one byte more than is allowed, so that the reader can tell and refuse it
    except OSError as e:
        raise SceneError([Problem("scene", f"cannot read the file: {e.strerror or e}", "", str(path))]) from e
    name = path.parent.name if path.name == SCENE_FILE else path.stem
    return scene_from_text(content, str(path), path.suffix.lower() == ".json", name, path.parent, massless)


def _file(source: str | os.PathLike[str]) -> FilePath:
    """The file that a name means: an existing one, else a bundled model's."""
    text = os.fspath(source)
    path = FilePath(text)
    try:
        if path.is_dir() and (path / SCENE_FILE).is_file():
            return path / SCENE_FILE
        if path.exists() and not path.is_dir():
            return path
        others = sorted(p for p in path.iterdir() if p.suffix.lower() in SUFFIXES) if path.is_dir() else None
    except (OSError, ValueError):  # the name is one that no file system takes
        others = None
    if others is not None and text not in bundled_names():
        raise SceneError([_no_scene_in(path, others, text)])
    if path.suffix.lower() in SUFFIXES or len(path.parts) > 1:
        raise SceneError([Problem("scene", "there is no such file", "", text[:200])])
    return model_file(text)


def _no_scene_in(folder: FilePath, others: Sequence[FilePath], text: str) -> Problem:
    """The problem of a folder that holds no scene.yaml, or only scenes of other names."""
    shown = ", ".join(map(str, others[:MOST_NAMED]))
    hint = f"give the file itself: {shown}" if others else f"a scene's folder holds one; `trunnion new {folder.name}` writes one"
    return Problem("scene", f"the folder has no {SCENE_FILE}", hint, text[:200])


def scene_from_text(
    content: bytes | str,
    file: str = "",
    is_json: bool = False,
    name: str = "",
    folder: FilePath | None = None,
    massless: bool = False,
) -> Scene:
    """The scene in YAML (or JSON) text; ``name`` is used where it gives none; ``folder``: where the files are that it names (none
    are read without it); massless: as for ``load_scene``."""
    doc = read(content, is_json)
    if doc.data is None and not doc.findings:
        doc.findings.append(Finding((), "the file is empty", "a scene has bodies and joints"))
    if doc.data is None or not isinstance(doc.data, dict):
        if doc.data is not None:
            doc.findings.append(Finding((), "a scene is a group of keys", "begin with bodies: and joints:", 1))
        raise error_of(doc.findings, doc.lines, file)
    if name and "name" not in doc.data:
        doc.data["name"] = name
    return scene_from_data(doc.data, doc.findings, doc.lines, file, folder, massless)


def scene_from_dict(data: Mapping[str, Any], massless: bool = False) -> Scene:
    """The scene in nested dicts and lists, as they would stand in a file; massless: as for ``load_scene``."""
    return scene_from_data(copied(data), massless=massless)


def _weighed(data: dict[str, Any]) -> None:
    """Give every body that has none a mass, and where it has no shape an inertia."""
    bodies = data.get("bodies")
    for body in bodies.values() if isinstance(bodies, dict) else ():
        if isinstance(body, dict) and not {"mass", "density"} & set(body):
            body["mass"] = 1.0
            if not {"box", "cylinder", "sphere", "inertia"} & set(body):
                body["inertia"] = [1.0, 1.0, 1.0]


def scene_from_data(
    data: dict[str, Any],
    found: Iterable[Finding] = (),
    lines: Mapping[Path, int] | None = None,
    file: str = "",
    folder: FilePath | None = None,
    massless: bool = False,
) -> Scene:
    """Build and check plain data. SceneError lists all problems, ``found`` (those of reading the file) among them, in the order
    of the file; lines: the line of every path; folder: where files that it names are, None where none are read; massless: as for
    ``load_scene``."""
    data, lines, composed = whole(data, dict(lines or {}), file, folder)
    data, wrong = evaluated(data)
    if massless:
        _weighed(data)
    built = build(data)
    told = {f.path for f in composed}
    found = [*found, *composed, *wrong, *(f for f in built.findings if f.hint != MEND_FIRST and f.path not in told)]
    if built.scene is not None and not composed:  # what is missing then has consequences everywhere
        found += [f for f in findings(built.scene) if not built.hides(f)]
    if found or built.scene is None:
        raise error_of(found, lines, file)
    return built.scene
