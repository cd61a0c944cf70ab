"""Problems a user can mend: each says where, what, and what to do; all of them are reported at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

LONGEST_WHERE = 300
"""Characters of a place that are told: no name anyone reads is longer."""
MOST = 100
"""Problems one error lists; the rest are counted. Who made a thousand mistakes made one of them a thousand times."""


@dataclass(frozen=True)
class Problem:
    """One mistake in what the user gave us.

    where: dotted path in the scene (``joints.ball.friction.radius``) or the name of an option.
    what:  the cause, in one sentence.
    hint:  the remedy, in one sentence ('' when the cause says it all).
    file, line: place in the file when it came from one (line counts from 1; 0 = unknown).
    count: how many problems this line stands for: more than one in the last line of a long list (``rest``).
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
        """The problem as plain data for JSON (command line ``--json``, REST problem lists)."""
        return {"where": self.where, "what": self.what, "hint": self.hint, "file": self.file, "line": self.line}


def rest(count: int) -> Problem:
    """The line that stands for problems which are not listed."""
    return Problem(f"and {count} more", "not listed", "mend these first", count=count)


class SceneError(ValueError):
    """Wrong use: the scene (or an option) has one or more problems.

    ``.problems`` holds the first MOST of them and, where there are more, a last line that counts the others; ``.total`` is the
    number of all. Problems of several errors may be joined: their last lines are added up.
    """

    def __init__(self, problems: Iterable[Problem], more: int = 0):
        told = list(problems)
        listed = [p for p in told if p.count == 1]
        more += sum(p.count for p in told if p.count != 1) + len(listed[MOST:])
        self.total = len(listed[:MOST]) + more
        self.problems: tuple[Problem, ...] = (*listed[:MOST], *([rest(more)] if more else []))
        super().__init__("\n".join(map(str, self.problems)))

    def __reduce__(self) -> tuple[type[SceneError], tuple[tuple[Problem, ...]]]:
        """Keep the problems when the error is sent from another process."""
        return SceneError, (self.problems,)


class SimulationError(RuntimeError):
    """The run could not be started or carried out; the text says why and what to try."""
