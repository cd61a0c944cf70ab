"""The starter scene: a pendulum on a frictional hinge; comments in the file show the other features of the format."""

from __future__ import annotations

import os
import re
from pathlib import Path
from string import Template

from trunnion.basics.errors import Problem, SceneError
from trunnion.elements.friction import DEFAULT, twin_of
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)


def starter_text(name: str) -> str:
    """The commented scene as YAML text."""
    smooth = twin_of(DEFAULT)
    others = ", ".join(law for law in LAWS if law not in (DEFAULT, smooth))
    return _filled("starter_scene.yaml", name=name, law=DEFAULT, smooth=smooth, others=others, types=", ".join(REGISTRY))


def _filled(template: str, **words: str) -> str:
    """The text of a template beside this file, with a word in place of each ``$`` name."""
    return Template(Path(__file__).with_name(template).read_text(encoding="utf-8")).substitute(words)


def write_starter(name: str, directory: str | os.PathLike[str] = ".") -> Path:
    """Write NAME/scene.yaml and NAME/README.md into a directory; the result is the new folder. Raises SceneError when the folder
    exists or cannot be written."""
    folder = Path(directory) / name
    if not _NAME.fullmatch(name):
        raise SceneError([Problem(name[:60], "cannot be the name of a scene", "a letter, then letters, digits and _")])
    if folder.exists():
        raise SceneError([Problem(name, "exists already", "choose another name, or remove it", str(folder))])
    try:
        folder.mkdir(parents=True)
        (folder / "scene.yaml").write_text(starter_text(name), encoding="utf-8")
        (folder / "README.md").write_text(_filled("starter_readme.txt", name=name), encoding="utf-8")
    except OSError as e:
        raise SceneError([Problem(name, f"cannot write: {e.strerror or e}", "", str(folder))]) from e
    return folder
