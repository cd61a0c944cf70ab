"""Composition of a whole scene: includes and assemblies are replaced by their contents."""

from __future__ import annotations

from pathlib import Path as FilePath
from typing import Any

from trunnion.scene.composition.data_with_source_lines import Level, TooMuch, copy_of
from trunnion.scene.composition.deprecated_keys import replace_deprecated
from trunnion.scene.composition.reference_renaming import restore_on
from trunnion.scene.file_format.yaml_reader import MOST
from trunnion.scene.findings.findings_and_paths import Finding, Path


def compose(data: Any, lines: dict[Path, int], file: str, folder: FilePath | None) -> tuple[Any, dict[Path, int], list[Finding]]:
    """(data without includes and assemblies, the line of every path, mistakes in includes and assemblies). ``folder`` is None if
    files must not be read."""
    if isinstance(data, dict):
        replace_deprecated(data, lines)
        restore_on(data)
    if not isinstance(data, dict) or not (data.get("include") or data.get("assemblies")):
        rest = {k: v for k, v in data.items() if k not in ("include", "assemblies") or v} if isinstance(data, dict) else data
        return rest, lines, []
    from trunnion.scene.composition.assembly_expansion import expand_assemblies  # imported here, because few scenes have assemblies

    chain = (FilePath(file).resolve(),) if folder is not None and file else ()
    level = Level(copy_of(data), lines, folder, "", chain)
    try:
        expand_assemblies(level)
    except TooMuch:
        level.add_problem(("assemblies",), f"the copies have more than {MOST} values", "make fewer copies")
        level.data |= {"bodies": {}, "joints": {}, "forces": {}}
    level.data.pop("include", None)
    level.data.pop("assemblies", None)
    return level.data, level.lines, level.findings
