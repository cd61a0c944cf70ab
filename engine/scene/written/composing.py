"""A whole scene from what is written: includes and assemblies are replaced by what they stand for."""

from __future__ import annotations

from pathlib import Path as FilePath
from typing import Any

from engine.scene.finding import Finding, Path
from engine.scene.reading import MOST
from engine.scene.written.assembling import assembled
from engine.scene.written.names import read_on
from engine.scene.written.origins import Level, TooMuch, copied


def whole(data: Any, lines: dict[Path, int], file: str, folder: FilePath | None) -> tuple[Any, dict[Path, int], list[Finding]]:
    """(data without includes and assemblies, the line of every path, mistakes in them)."""
    if isinstance(data, dict):
        read_on(data)
    if not isinstance(data, dict) or not (data.get("include") or data.get("assemblies")):
        rest = {k: v for k, v in data.items() if k not in ("include", "assemblies") or v} if isinstance(data, dict) else data
        return rest, lines, []
    chain = (FilePath(file).resolve(),) if folder is not None and file else ()
    level = Level(copied(data), lines, folder, "", chain)
    try:
        assembled(level)
    except TooMuch:
        level.told(("assemblies",), f"copies become more than {MOST} values", "make fewer copies")
        level.data |= {"bodies": {}, "joints": {}, "forces": {}}
    level.data.pop("include", None)
    level.data.pop("assemblies", None)
    return level.data, level.lines, level.findings
