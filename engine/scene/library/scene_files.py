"""Finds the scene file that a user means by a file, a folder, or the name of a bundled model."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path as FilePath

from trunnion.basics.errors import Problem, SceneError
from trunnion.scene.library.model_folders import SCENE_FILE, bundled_names, model_file

SUFFIXES = (".yaml", ".yml", ".json")
LARGEST = 5_000_000
"""Largest size of a file in bytes."""
MOST_NAMED = 5
"""Largest number of files that a hint lists."""


def scene_file(source: str | os.PathLike[str]) -> FilePath:
    """The scene file for ``source``: an existing file or folder, else a bundled model. Raises SceneError when there is none."""
    text = os.fspath(source)
    path = FilePath(text)
    try:
        if path.is_dir() and (path / SCENE_FILE).is_file():
            return path / SCENE_FILE
        if path.exists() and not path.is_dir():
            return path
        others = sorted(p for p in path.iterdir() if p.suffix.lower() in SUFFIXES) if path.is_dir() else None
    except (OSError, ValueError):  # the text is not a valid file name
        others = None
    if others is not None and text not in bundled_names():
        raise SceneError([_no_scene_in(path, others, text)])
    if path.suffix.lower() in SUFFIXES or len(path.parts) > 1:
        raise SceneError([Problem("scene", "there is no such file", "", text[:200])])
    return model_file(text)


def _no_scene_in(folder: FilePath, others: Sequence[FilePath], text: str) -> Problem:
    """The problem of a folder without scene.yaml; ``others`` are its other scene files."""
    shown = ", ".join(map(str, others[:MOST_NAMED]))
    hint = f"give the file itself: {shown}" if others else f"`trunnion new {folder.name}` writes a scene folder"
    return Problem("scene", f"the folder has no {SCENE_FILE}", hint, text[:200])


def content_of(path: FilePath) -> bytes:
    """The bytes of a scene file. Raises SceneError when it cannot be read."""
    try:
        with path.open("rb") as f:
            return f.read(LARGEST + 1)  # one byte above the limit is enough for the reader to detect a file that is too large
    except OSError as e:
        raise SceneError([Problem("scene", f"cannot read the file: {e.strerror or e}", "", str(path))]) from e
