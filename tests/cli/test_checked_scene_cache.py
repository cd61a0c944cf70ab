"""Commands store checked scenes. A stored scene equals the scene in the file, and a changed file is read again."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from trunnion.basics.renamed_words import deprecation_notes
from trunnion.cli.options import checked_scene_cache
from trunnion.cli.options.checked_scene_cache import stored_scene
from trunnion.kernel.compilation import library_cache
from trunnion.scene import load_scene
from trunnion.scene.library.model_folders import bundled_names, model_file

SMALL = """
schema: 1
bodies: {arm: {box: [0.6 m, 40 mm, 40 mm], density: 7800}}
joints: {pivot: {type: revolute, axis: z, inboard: ground, outboard: arm, friction: {mu: 0.12, radius: 8 mm, half_length: 15 mm}}}
"""


@pytest.fixture
def read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """An empty cache. Returns the list of files that have been read and checked."""
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path / "cache"))
    files: list[Path] = []
    true = checked_scene_cache._scene
    monkeypatch.setattr(checked_scene_cache, "_scene", lambda content, file, *a: files.append(file) or true(content, file, *a))
    return files


@pytest.mark.parametrize("name", bundled_names())
def test_a_stored_scene_equals_the_scene_that_is_read(name: str, read: list[Path]) -> None:
    both = stored_scene(name), stored_scene(name)
    assert both == (load_scene(name),) * 2
    named = any(mark in model_file(name).read_bytes() for mark in checked_scene_cache.OTHER_FILES)
    assert len(read) == (2 if named else 1)


def test_a_changed_file_is_read_again(tmp_path: Path, read: list[Path]) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(SMALL)
    same = file.stat()
    assert stored_scene(str(file)).joints["pivot"].friction.mu == 0.12
    file.write_text(SMALL.replace("0.12", "0.21"))
    os.utime(file, ns=(same.st_atime_ns, same.st_mtime_ns))
    assert stored_scene(str(file)).joints["pivot"].friction.mu == 0.21
    assert stored_scene(str(file), massless=True) == load_scene(file, massless=True)
    assert len(read) == 3


@pytest.mark.parametrize("part", ["digest_of_files", "version_of"])
def test_other_code_or_other_packages_read_again(part: str, read: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    stored_scene("simple_pendulum")
    home = library_cache if part == "digest_of_files" else checked_scene_cache
    monkeypatch.setattr(home, part, lambda *_: "another")
    stored_scene("simple_pendulum")
    assert len(read) == 2


def test_a_digest_of_files_follows_their_content(tmp_path: Path, read: list[Path]) -> None:
    folder = tmp_path / "code"
    (folder / "inner").mkdir(parents=True)
    (folder / "inner" / "a.py").write_text("1")
    first = library_cache.digest_of_files(tmp_path, ["code"], (".py",))
    assert library_cache.digest_of_files(tmp_path, ["code"], (".py",)) == first
    (folder / "b.txt").write_text("other files do not count")
    assert library_cache.digest_of_files(tmp_path, ["code"], (".py",)) == first
    (folder / "inner" / "a.py").write_text("2")
    assert library_cache.digest_of_files(tmp_path, ["code"], (".py",)) != first


def test_a_scene_with_other_files_is_read_each_time(tmp_path: Path, read: list[Path]) -> None:
    (tmp_path / "base.yaml").write_text(SMALL)
    file = tmp_path / "more.yaml"
    file.write_text("include: base.yaml\n")
    assert stored_scene(str(file)).joints["pivot"].friction.mu == 0.12
    (tmp_path / "base.yaml").write_text(SMALL.replace("0.12", "0.21"))
    assert stored_scene(str(file)).joints["pivot"].friction.mu == 0.21


def test_a_damaged_entry_is_not_served(tmp_path: Path, read: list[Path]) -> None:
    whole = stored_scene("simple_pendulum")
    (entry,) = (tmp_path / "cache").glob("scene-*/scene")
    entry.write_bytes(entry.read_bytes()[:-7])
    assert stored_scene("simple_pendulum") == whole
    assert len(read) == 2


def test_a_stored_scene_repeats_the_notes_about_deprecated_words(tmp_path: Path, read: list[Path]) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(SMALL.replace("friction:", "stops: {stiffness: 1 kN*m/rad, lower: -1}, friction:"))
    told = []
    for _ in range(2):
        with deprecation_notes() as notes:
            stored_scene(str(file))
        told.append(notes)
    assert told[0] == told[1] != []
    assert len(read) == 1
