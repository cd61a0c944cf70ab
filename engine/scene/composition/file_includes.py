"""Included files: a scene gets the keys that it lacks from the files that it includes."""

from __future__ import annotations

from pathlib import Path as FilePath
from typing import Any

from trunnion.scene.composition.data_with_source_lines import Level, copy_of
from trunnion.scene.composition.deprecated_keys import replace_deprecated
from trunnion.scene.file_format.yaml_reader import Document, read
from trunnion.scene.findings.findings_and_paths import Finding, Line, Path
from trunnion.scene.findings.name_suggestions import shown
from trunnion.scene.library.scene_files import LARGEST

SUFFIXES = (".yaml", ".yml", ".json")
DEEPEST = 20
"""Longest chain of files that refer to one another."""
NOT_READ = "a scene given as text or data cannot refer to files"
WHOLE = "send the whole scene: `trunnion check FILE -o whole.yaml` writes it"


def merge_includes(level: Level) -> None:
    """Merge the files under ``include`` into a level. The level's own keys have priority over keys of files, and later files have
    priority over earlier files."""
    given = level.data.pop("include", None)
    names = [given] if isinstance(given, str) else given
    if names is None:
        return
    if not isinstance(names, list) or not all(isinstance(n, str) for n in names):
        level.add_problem(("include",), f"the name of a file, or a list of them, is expected, not {shown(given)}")
        return
    for i, name in reversed(list(enumerate(names))):
        other = part_of_file(level, ("include", i) if isinstance(given, list) else ("include",), name)
        if other is not None:
            merge_includes(other)
            level.findings += other.findings
            _merge(level, other, level.data, other.data, ())


def _merge(level: Level, other: Level, own: dict[str, Any], taken: dict[str, Any], path: Path) -> None:
    for key, value in taken.items():
        if key not in own:
            level.take((*path, key), value, other, (*path, key))
        elif isinstance(own[key], dict) and isinstance(value, dict):
            _merge(level, other, own[key], value, (*path, key))


def part_of_file(level: Level, path: Path, name: str) -> Level | None:
    """The content of a file in the level's folder, as a new level. If the file cannot be read, the function adds a finding at
    ``path`` and returns None."""
    if level.folder is None:
        level.add_problem(path, f"{shown(name)} is not read: {NOT_READ}", WHOLE)
        return None
    file = level.folder / name
    if file.suffix.lower() not in SUFFIXES:
        level.add_problem(path, f"{shown(name)} is not a scene file", f"files end with {', '.join(SUFFIXES)}")
        return None
    if (real := file.resolve()) in level.chain:
        level.add_problem(path, f"{shown(name)} includes itself, possibly through other files", "remove it from one of the files")
        return None
    if len(level.chain) >= DEEPEST:
        level.add_problem(path, f"more than {DEEPEST} files include one another in a chain")
        return None
    try:
        with file.open("rb") as f:
            doc = read(f.read(LARGEST + 1), file.suffix.lower() == ".json")
    except (OSError, ValueError) as e:
        why = e.strerror if isinstance(e, OSError) and e.strerror else str(e)
        level.add_problem(path, f"cannot read {shown(str(file), 200)}: {why}", "names are relative to the folder of this file")
        return None
    return _level_of(level, path, doc, file, real)


def _level_of(level: Level, path: Path, doc: Document, file: FilePath, real: FilePath) -> Level | None:
    for f in doc.findings:
        level.findings.append(Finding((*path, *f.path), f.what, f.hint, Line(f.line, str(file))))
    if not isinstance(doc.data, dict):
        if not doc.findings:
            level.add_problem(path, f"{shown(str(file), 200)} holds no group of keys")
        return None
    lines: dict[Path, int] = {p: Line(n, str(file)) for p, n in doc.lines.items()}
    replace_deprecated(doc.data, lines)
    return Level(copy_of(doc.data), lines, file.parent, str(file), (*level.chain, real), [], level.budget)
