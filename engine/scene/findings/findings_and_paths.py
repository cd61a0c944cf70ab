"""Findings: mistakes at a path inside a scene, before file and line are known. This module also converts paths to and from text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from trunnion.basics.errors import MOST, Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.findings.name_suggestions import Nearest

Path = tuple[str | int, ...]
"""Keys and 0-based indices from the top of the scene."""


CONNECTIONS: Path = ("connections",)
"""A path that stands for the connections of all joints. Checks that need every joint to be valid depend on this path."""


class Line(int):
    """A line of a file other than the scene file. ``file`` is the name of this file. ``copy``: whether an assembly repeats the line
    in several copies."""

    file: str
    copy: bool

    def __new__(cls, line: int, file: str, copy: bool = False) -> Line:
        self = int.__new__(cls, line)
        self.file, self.copy = file, copy
        return self


@dataclass(frozen=True)
class Finding:
    """A mistake: ``path`` is its place in the scene, ``what`` the cause, ``hint`` the remedy.

    line   the line of the file; 0 means that the line is looked up from the path.
    about  paths of other parts on which the mistake depends; if one of these parts is missing, the finding is dropped.
    meant  for an unknown key: the closest known key ('' when no key is close); None for other findings.
    """

    path: Path
    what: str
    hint: str | Nearest = ""
    line: int = 0
    about: tuple[Path, ...] = ()
    meant: str | None = None


def dotted(path: Path) -> str:
    """A path as text, such as joints.ball.start.q[2]: dots between keys, and indices in brackets, counted from 1."""
    text = ""
    for step in path:
        text += f"[{step + 1}]" if isinstance(step, int) else f".{step}" if text else step
    return text or "scene"


def last_key(path: Path) -> str:
    """The last key of a path and the indices after it, such as mu or radius[2]."""
    at = max((i for i, step in enumerate(path) if isinstance(step, str)), default=0)
    return dotted(path[at:])


_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]", re.ASCII)
_WHOLE = re.compile(r"[^.\[\]]+(?:\[\d{1,6}\])*(?:\.[^.\[\]]+(?:\[\d{1,6}\])*)*", re.ASCII)


def parse_path(text: str) -> Path | None:
    """Parse a path such as joints.ball.start.q[2] (indices in the text count from 1); None when the syntax is invalid."""
    if not _WHOLE.fullmatch(text):
        return None
    steps: Path = tuple(m[1] if m[1] else int(m[2]) - 1 for m in _STEP.finditer(text))
    return None if -1 in steps else steps


def line_of(path: Path, lines: Mapping[Path, int]) -> int:
    """Line of a path or of the nearest enclosing part that has a line; 0 if there is none."""
    while path and path not in lines:
        path = path[:-1]
    return lines.get(path, 0)


def problem(f: Finding, lines: Mapping[Path, int], file: str = "") -> Problem:
    """The finding with its path as text, its file and its line."""
    line = f.line or line_of(f.path, lines)
    return Problem(dotted(f.path), f.what, str(f.hint), getattr(line, "file", "") or file, int(line))


def _once(found: list[Finding], lines: Mapping[Path, int]) -> Iterator[Finding]:
    """The findings without repetition: a line that an assembly repeats in several copies is reported only once."""
    seen = set()
    for f in found:
        line = f.line or line_of(f.path, lines)
        if isinstance(line, Line) and line.copy:
            same = (int(line), line.file, f.path[-1:], f.what)
            if same in seen:
                continue
            seen.add(same)
        yield f


def error_of(found: Iterable[Finding], lines: Mapping[Path, int], file: str = "") -> SceneError:
    """All findings as one error, in the order of the file. Only the first ``MOST`` findings become text, because a hint may
    need a search among all names of the scene."""

    def place(f: Finding) -> tuple[str, int]:
        line = f.line or line_of(f.path, lines)
        return getattr(line, "file", ""), int(line)

    every = list(_once(sorted(found, key=place), lines))
    return SceneError([problem(f, lines, file) for f in every[:MOST]], more=len(every[MOST:]))
