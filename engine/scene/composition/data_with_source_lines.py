"""Plain data with the source line of every path. Values from other files, and values of copies, keep the lines from which they
come."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from pathlib import Path as FilePath
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.file_format.yaml_reader import MOST
from trunnion.scene.findings.findings_and_paths import Finding, Line, Path, line_of


class TooMuch(Exception):
    """Raised when the expanded assemblies have more values than a scene may have."""


@dataclass
class Budget:
    """The number of values that may still be added."""

    left: int = field(default_factory=lambda: MOST)

    def spend(self, count: int) -> None:
        """Subtract ``count`` added values. Raises TooMuch when the budget is exceeded."""
        self.left -= count
        if self.left < 0:
            raise TooMuch


@dataclass
class Level:
    """A scene or a part during composition.

    data    its groups
    lines   the source line of every path
    folder  the folder of the files that the data name; None if files must not be read
    file    the name of the scene's or part's file in messages
    chain   the files whose includes led to this one
    budget  shared by all levels
    """

    data: dict[str, Any]
    lines: dict[Path, int]
    folder: FilePath | None = None
    file: str = ""
    chain: tuple[FilePath, ...] = ()
    findings: list[Finding] = field(default_factory=list)
    budget: Budget = field(default_factory=Budget)

    def add_problem(self, path: Path, what: str, hint: str = "") -> None:
        """Add a finding at a path of this level."""
        self.findings.append(Finding(path, what, hint, self.line(path)))

    def line(self, path: Path) -> int:
        """The line (and file) of a path, or of the nearest enclosing part that has a line."""
        found = line_of(path, self.lines)
        return found if isinstance(found, Line) or not self.file else Line(found, self.file)

    def below(self, path: Path, data: dict[str, Any]) -> Level:
        """A new level with a copy of a group of this level."""
        lines = {p[len(path) :]: self.line(p) for p in paths_below(data, path)}
        return Level(copy_of(data), lines, self.folder, self.file, self.chain, [], self.budget)

    def take(self, path: Path, value: Any, origin: Level, at: Path, copy: bool = False) -> None:
        """Store the value that level ``origin`` has at path ``at``. The value and its source lines are stored at ``path``."""
        node = self.data
        for key in path[:-1]:
            node = node.setdefault(str(key), {})
            if not isinstance(node, dict):
                return  # validation reports that this value must be a group
        node[str(path[-1])] = value
        count = 0
        for p in paths_below(value, at):
            count += 1
            line = origin.line(p)
            self.lines[(*path, *p[len(at) :])] = Line(line, getattr(line, "file", ""), copy)
        self.budget.spend(count)


def paths_below(value: Any, path: Path) -> Iterable[Path]:
    """The path of a value and the paths of all values inside it."""
    yield path
    if isinstance(value, Mapping):
        for k, v in value.items():
            yield from paths_below(v, (*path, k))
    elif isinstance(value, list):
        for i, v in enumerate(value):
            yield from paths_below(v, (*path, i))


def copy_of(value: Any) -> Any:
    """A deep copy of groups and lists."""
    if isinstance(value, dict):
        return {k: copy_of(v) for k, v in value.items()}
    return [copy_of(v) for v in value] if isinstance(value, list) else value
