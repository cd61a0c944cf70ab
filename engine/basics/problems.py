"""Problems a user can mend: each says where, what, and what to do; all of them are reported at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Problem:
    """One mistake in what the user gave us.

    where: dotted path in the scene (``joints.ball.friction.radius``) or the name of an option.
    what:  the cause, in one sentence.
    hint:  the remedy, in one sentence ('' when the cause says it all).
    file, line: place in the file when it came from one (line counts from 1; 0 = unknown).
    """

    where: str
    what: str
    hint: str = ""
    file: str = ""
    line: int = 0

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}: " if self.file and self.line else f"{self.file}: " if self.file else ""
        return f"{place}{self.where}: {self.what}" + (f" ({self.hint})" if self.hint else "")

    def as_dict(self) -> dict[str, object]:
        """The same, for JSON (command line ``--json``, REST problem lists)."""
        return {"where": self.where, "what": self.what, "hint": self.hint, "file": self.file, "line": self.line}


class SceneError(ValueError):
    """Wrong use: the scene (or an option) has one or more problems. ``.problems`` holds every one of them."""

    def __init__(self, problems: Iterable[Problem]):
        self.problems: tuple[Problem, ...] = tuple(problems)
        super().__init__("\n".join(map(str, self.problems)))

    def __reduce__(self) -> tuple[type[SceneError], tuple[tuple[Problem, ...]]]:
        """Comes whole from another process."""
        return SceneError, (self.problems,)


class SimulationError(RuntimeError):
    """The run could not be started or carried out; the text says why and what to try."""
