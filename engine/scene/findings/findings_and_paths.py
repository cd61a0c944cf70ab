"""A mistake at a path inside a scene, before file and line are known; and paths as text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from trunnion.basics.problems import MOST, Problem, SceneError
from trunnion.scene.findings.name_suggestions import Nearest

Path = tuple[str | int, ...]
"""Keys and 0-based indices from the top of the scene."""


CONNECTIONS: Path = ("connections",)
"""Stands, as a path, for everything that depends on all joints being known."""


class Line(int):
    """A line of another file than the scene's own. file: its name; copy: whether several parts were made of what stands there."""

    file: str
    copy: bool

    def __new__(cls, line: int, file: str, copy: bool = False) -> Line:
        self = int.__new__(cls, line)
        self.file, self.copy = file, copy
        return self


@dataclass(frozen=True)
class Finding:
    """A mistake. path: where it is in the scene; what: the cause; hint: the remedy.

    line   the line of the file, where the path does not tell it (0: look the path up).
    about  other parts the finding depends on; it means nothing when one of them could not be read.
    meant  only for an unknown key: the key it may stand for ('' when none is close); None for other findings.
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
    """The last key of a path with the indices behind it, such as mu or radius[2]."""
    at = max((i for i, step in enumerate(path) if isinstance(step, str)), default=0)
    return dotted(path[at:])


_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]", re.ASCII)
_WHOLE = re.compile(r"[^.\[\]]+(?:\[\d{1,6}\])*(?:\.[^.\[\]]+(?:\[\d{1,6}\])*)*", re.ASCII)


def parse_path(text: str) -> Path | None:
    """The path that a text such as joints.ball.start.q[2] stands for (indices count from 1); None when it is no path."""
    if not _WHOLE.fullmatch(text):
        return None
    steps: Path = tuple(m[1] if m[1] else int(m[2]) - 1 for m in _STEP.finditer(text))
    return None if -1 in steps else steps


def line_of(path: Path, lines: Mapping[Path, int]) -> int:
    """Line of a path, or of the nearest enclosing part that is in the file; 0 when there is no file."""
    while path and path not in lines:
        path = path[:-1]
    return lines.get(path, 0)


def problem(f: Finding, lines: Mapping[Path, int], file: str = "") -> Problem:
    """The finding as the user sees it."""
    line = f.line or line_of(f.path, lines)
    return Problem(dotted(f.path), f.what, str(f.hint), getattr(line, "file", "") or file, int(line))


def _once(found: list[Finding], lines: Mapping[Path, int]) -> Iterator[Finding]:
    """The findings, those of lines of which several copies were made once only."""
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
    """All findings as one error, in the order of the file. Only those that are listed are put into words, since a hint may take
    a search among all names of the scene."""

    def place(f: Finding) -> tuple[str, int]:
        line = f.line or line_of(f.path, lines)
        return getattr(line, "file", ""), int(line)

    every = list(_once(sorted(found, key=place), lines))
    return SceneError([problem(f, lines, file) for f in every[:MOST]], more=len(every[MOST:]))
