"""Cache of checked scenes. A command that reads an unchanged file again skips the validation and the imports for validation."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

from trunnion.basics.renamed_words import add_note, deprecation_notes
from trunnion.kernel.compilation import library_cache
from trunnion.kernel.compilation.c_compiler import version_of
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.library.scene_files import content_of, scene_file

ENGINE = Path(__file__).resolve().parents[2]
SOURCES = ("basics", "elements", "runtime", "scene")
"""Folders whose code reads and checks a scene: ``scene``, and the folders that ``scene`` imports."""
OTHER_FILES = (b"include", b"assemblies", b"\\", b"\0")
"""Keys that name other files, and bytes of escaped or wide characters, which could spell these keys. A scene that contains none of
these bytes names no other file."""


def stored_scene(source: str, massless: bool = False) -> Scene:
    """The scene that ``load_scene`` reads. The cache's key of a scene covers everything on which the scene depends: path and
    content of the file, Trunnion's sources, Python, and the packages that read and validate. Scenes that name other files are
    not stored."""
    file = scene_file(source)
    content = content_of(file)
    if any(mark in content for mark in OTHER_FILES):
        return _scene(content, file, massless)
    versions = (sys.version, *map(version_of, ("pydantic", "pydantic_core", "PyYAML")))
    code = library_cache.digest_of_files(ENGINE, SOURCES, (".py",))
    name = f"scene-{library_cache.digest(str(file.absolute()), content, str(massless), code, *versions)}"

    def make(folder: Path) -> None:
        with deprecation_notes() as notes:
            data = pickle.dumps((_scene(content, file, massless), tuple(notes)))
        (folder / "scene").write_bytes(data)
        (folder / "digest").write_text(library_cache.digest(data))

    folder, _ = library_cache.entry(name, make)
    data = (folder / "scene").read_bytes()
    if (folder / "digest").read_text() != library_cache.digest(data):
        return _scene(content, file, massless)
    scene, notes = pickle.loads(data)
    for note in notes:
        add_note(note)
    found: Scene = scene
    return found


def _scene(content: bytes, file: Path, massless: bool) -> Scene:
    from trunnion.scene.scene_loader import scene_of, source_of_content

    return scene_of(source_of_content(content, file), massless)
