"""Problems that a user can fix. Each problem has a place, a cause and a remedy. An error reports all problems together."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from trunnion.basics.lazy_data_classes import dataclass

LONGEST_WHERE = 300
"""Largest number of characters of a problem's place in a message."""
MOST = 100
"""Largest number of problems that an error lists. A last line gives the number of further problems."""


@dataclass(frozen=True)
class Problem:
    """One mistake in the input.

    Attributes:
        where: dotted path in the scene (``joints.ball.friction.radius``), or name of an option.
        what: the cause, in one sentence.
        hint: the remedy, in one sentence; "" if the cause implies the remedy.
        file: the file with the mistake; "" if the mistake is not in a file.
        line: line of the mistake in the file, from 1; 0: unknown.
        count: number of problems that this object stands for; above 1 only in the last line of a long list.
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
    """The last line of a long list. This line states how many problems are not listed."""
    return Problem(f"and {count} more", "not listed", "mend these first", count=count)


class SceneError(ValueError):
    """The scene (or an option) has one or more problems.

    ``.problems`` holds at most MOST problems, and a last line with the number of further problems. ``.total`` is the number of all
    problems. The argument ``problems`` may contain such last lines of other errors; their numbers add up. The argument ``more`` is
    the number of problems that the caller has not listed."""

    def __init__(self, problems: Iterable[Problem], more: int = 0):
        told = list(problems)
        listed = [p for p in told if p.count == 1]
        more += sum(p.count for p in told if p.count != 1) + len(listed[MOST:])
        self.total = len(listed[:MOST]) + more
        self.problems: tuple[Problem, ...] = (*listed[:MOST], *([rest(more)] if more else []))
        super().__init__("\n".join(map(str, self.problems)))

    def __reduce__(self) -> tuple[type[SceneError], tuple[tuple[Problem, ...]]]:
        """Pickle the error with its problems, so that an error from another process keeps the problems."""
        return SceneError, (self.problems,)


def raise_problems(problems: Collection[Problem]) -> None:
    """Raise SceneError if there are problems."""
    if problems:
        raise SceneError(problems)


class SimulationError(RuntimeError):
    """A run cannot start or continue. The text names cause and remedy."""
