"""Plain data together with where every part of it was written: what is taken from other files and copied keeps its line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

from trunnion.scene.file_format.yaml_reader import MOST
from trunnion.scene.findings.findings_and_paths import Finding, Line, Path


class TooMuch(Exception):
    """Copies of copies have become more than a scene may hold."""


@dataclass
class Budget:
    """How many values may still be made."""

    left: int = field(default_factory=lambda: MOST)

    def spend(self, count: int) -> None:
        """Note values that are made; TooMuch when there are too many."""
        self.left -= count
        if self.left < 0:
            raise TooMuch


@dataclass
class Level:
    """A scene or a part while it is put together. data: its groups; lines: where every path was written; folder: where its files
    are, None where none are read; file: its name in messages; chain: the files that led here; budget: shared by all levels."""

    data: dict[str, Any]
    lines: dict[Path, int]
    folder: FilePath | None = None
    file: str = ""
    chain: tuple[FilePath, ...] = ()
    findings: list[Finding] = field(default_factory=list)
    budget: Budget = field(default_factory=Budget)

    def add_problem(self, path: Path, what: str, hint: str = "") -> None:
        """Note a mistake at a path of this level."""
        self.findings.append(Finding(path, what, hint, self.line(path)))

    def line(self, path: Path) -> int:
        """Line of a path, or of the nearest part around it; it knows its file."""
        while path and path not in self.lines:
            path = path[:-1]
        found = self.lines.get(path, 0)
        return found if isinstance(found, Line) or not self.file else Line(found, self.file)

    def below(self, path: Path, data: dict[str, Any]) -> Level:
        """A group of this level as a level of its own."""
        lines = {p[len(path) :]: self.line(p) for p in paths_below(data, path)}
        return Level(copy_of(data), lines, self.folder, self.file, self.chain, [], self.budget)

    def take(self, path: Path, value: Any, origin: Level, at: Path, copy: bool = False) -> None:
        """Put a value of another level here, with its lines."""
        node = self.data
        for key in path[:-1]:
            node = node.setdefault(str(key), {})
            if not isinstance(node, dict):
                return  # the reader tells that a group is wanted here
        node[str(path[-1])] = value
        count = 0
        for p in paths_below(value, at):
            count += 1
            line = origin.line(p)
            self.lines[(*path, *p[len(at) :])] = Line(line, getattr(line, "file", ""), copy)
        self.budget.spend(count)


def paths_below(value: Any, path: Path) -> Iterable[Path]:
    """The path of a value and of everything in it."""
    yield path
    if isinstance(value, Mapping):
        for k, v in value.items():
            yield from paths_below(v, (*path, k))
    elif isinstance(value, list):
        for i, v in enumerate(value):
            yield from paths_below(v, (*path, i))


def copy_of(value: Any) -> Any:
    """The value with groups and lists of its own."""
    if isinstance(value, dict):
        return {k: copy_of(v) for k, v in value.items()}
    return [copy_of(v) for v in value] if isinstance(value, list) else value
