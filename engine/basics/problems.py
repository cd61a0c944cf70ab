"""Problems that a user can mend: place, cause and remedy of each, all reported at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

LONGEST_WHERE = 300
"""Longest place in a message, in characters."""
MOST = 100
"""Most problems that one error lists; the rest is counted."""


@dataclass(frozen=True)
class Problem:
    """One mistake in the input.

    Attributes:
        where: dotted path in the scene (``joints.ball.friction.radius``), or name of an option.
        what: the cause, in one sentence.
        hint: the remedy, in one sentence; "": the cause implies it.
        file: the file with the mistake; "": none.
        line: its line, from 1; 0: unknown.
        count: number of problems that this one stands for; more than 1 in the last line of a long list.
    """

    where: str
    what: str
    hint: str = ""
    file: str = ""
    line: int = 0
    count: int = 1

    def __post_init__(self) -> None:
        if len(self.where) > LONGEST_WHERE:
            object.__setattr__(self, "where", self.where[: LONGEST_WHERE - 1] + "…")

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}: " if self.file and self.line else f"{self.file}: " if self.file else ""
        return f"{place}{self.where}: {self.what}" + (f" ({self.hint})" if self.hint else "")

    def as_dict(self) -> dict[str, object]:
        """Plain data for JSON (command line ``--json``, REST problem lists)."""
        return {"where": self.where, "what": self.what, "hint": self.hint, "file": self.file, "line": self.line}


def rest(count: int) -> Problem:
    """The line that counts unlisted problems."""
    return Problem(f"and {count} more", "not listed", "mend these first", count=count)


class SceneError(ValueError):
    """The scene (or an option) has one or more problems.

    ``.problems`` holds the first MOST and, if there are more, a last line that counts the others; ``.total`` is the number of all.
    Problems of several errors may be joined: their last lines are added."""

    def __init__(self, problems: Iterable[Problem], more: int = 0):
        told = list(problems)
        listed = [p for p in told if p.count == 1]
        more += sum(p.count for p in told if p.count != 1) + len(listed[MOST:])
        self.total = len(listed[:MOST]) + more
        self.problems: tuple[Problem, ...] = (*listed[:MOST], *([rest(more)] if more else []))
        super().__init__("\n".join(map(str, self.problems)))

    def __reduce__(self) -> tuple[type[SceneError], tuple[tuple[Problem, ...]]]:
        """Keep the problems when the error comes from another process."""
        return SceneError, (self.problems,)


class SimulationError(RuntimeError):
    """A run cannot start or continue. The text names cause and remedy."""
