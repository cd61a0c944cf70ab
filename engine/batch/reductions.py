"""What is kept of a case: reductions of columns over its output rows, and counts and first times of its events.

Written ``kind:what``: ``max``, ``min``, ``mean`` and ``final`` of a column pattern (the first three over finite values), ``first``
(time, s) and ``count`` of a kind of event, ``stick`` or ``any``; ``error:`` before any of these is its global error. The name of
the table's column is the same text.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from engine.abi import EventKind
from engine.basics.patterns import MOST_WILD, is_wild
from engine.basics.problems import MOST, Problem, SceneError
from engine.kernel.columns import Column, select

OF_COLUMNS = ("max", "min", "final", "mean")
OF_EVENTS = ("first", "count")
OF_DECISIONS = ("margin", "marginal")
"""Of all events of a case that decide how it goes on: the least margin, and how many are below the run's own error."""
ERROR = "error"
EVENT_NUMBERS = {e.name.lower(): e.value for e in EventKind} | {"stick": EventKind.STOP.value}
DEFAULTS = (
    "max:*.contact[*].normal_force",
    "max:*.friction.torque[*]",
    "min:*.friction.torque[*]",
    "final:*.q[*]",
    "count:any",
    "first:any",
)
"""Patterns kept when none are asked for (those that match)."""


@dataclass(frozen=True)
class Reduction:
    """One number kept of every case. kind and what: one of OF_COLUMNS with the name of a column, or one of OF_EVENTS with the
    name of a kind of event, or ERROR with the name of another reduction; with its unit and description."""

    kind: str
    what: str
    unit: str
    description: str

    @property
    def name(self) -> str:
        """Name of its column in the table."""
        return f"{self.kind}:{self.what}"


def reductions(texts: Sequence[str], everything: Sequence[Column], where: str = "reductions") -> tuple[Reduction, ...]:
    """The reductions that texts mean, with a pattern replaced by the columns it matches; the default ones for no texts.
    SceneError names every text that means nothing."""
    found: dict[str, Reduction] = {}
    problems: list[Problem] = []
    names = {c.name: c for c in everything}
    wild = sum(map(is_wild, texts))
    if wild > MOST_WILD:
        problems.append(Problem(where, f"{wild} patterns with wild cards; {MOST_WILD} at most", "a few with * say the same"))
        texts = DEFAULTS
    for text in dict.fromkeys(texts or DEFAULTS):
        kind, sign, what = text.removeprefix(ERROR + ":").partition(":")
        if not sign or kind not in (*OF_COLUMNS, *OF_EVENTS) or not what:
            hint = "write max:PATTERN, min:, mean:, final:, or first:EVENT, count:EVENT; error: before one of them for its error"
            problems.append(Problem(where, f"{text!r} is no reduction", hint))
            continue
        new = _of_event(kind, what) if kind in OF_EVENTS else _of_columns(kind, what, names)
        new = [error_of(r) for r in new] if text.startswith(ERROR + ":") else new
        if not new and texts:
            problems.append(_unmatched(where, text, kind, what, names if len(problems) < MOST else ()))
        found |= {r.name: r for r in new}
    if problems:
        raise SceneError(problems)
    return tuple(found.values())


def error_of(r: Reduction) -> Reduction:
    """The global error of a reduction, as one."""
    return Reduction(ERROR, r.name, r.unit, f"global error of {r.name}: at most about; none where none is promised")


def with_errors(chosen: tuple[Reduction, ...], certify: bool) -> tuple[Reduction, ...]:
    """The reductions, and where they are certified the errors of those that are none."""
    if not certify:
        return chosen
    return tuple(dict.fromkeys((*chosen, *(error_of(r) for r in chosen if r.kind != ERROR))))


def about_errors(chosen: Iterable[Reduction]) -> bool:
    """Whether any of them is an error."""
    return any(r.kind == ERROR for r in chosen)


def _of_event(kind: str, what: str) -> list[Reduction]:
    if what != "any" and what not in EVENT_NUMBERS:
        return []
    text = what.replace("_", " ") if what != "any" else "event of any kind"
    if kind == "first":
        return [Reduction(kind, what, "s", f"time of the first {text}")]
    return [Reduction(kind, what, "1", f"number of events: {text}")]


def _of_columns(kind: str, pattern: str, names: Mapping[str, Column]) -> list[Reduction]:
    said = {"max": "largest", "min": "smallest", "final": "last", "mean": "mean"}[kind]
    chosen = select(list(names.values()), (pattern,)) if is_wild(pattern) else [names[pattern]] if pattern in names else []
    return [Reduction(kind, c.name, c.unit, f"{said} {c.description}") for c in chosen]


def _unmatched(where: str, text: str, kind: str, what: str, names: Iterable[str]) -> Problem:
    known = [*EVENT_NUMBERS, "any"] if kind in OF_EVENTS else list(names)
    near = get_close_matches(what[:80], known, 3, 0.4)
    things = "kind of event" if kind in OF_EVENTS else "column"
    hint = (
        f"did you mean {', '.join(near)}?"
        if near
        else f"one of {', '.join(known)}"
        if kind in OF_EVENTS
        else "see `trunnion check SCENE --outputs`"
    )
    return Problem(where, f"{text!r} matches no {things}", hint)


def wanted_columns(chosen: Sequence[Reduction]) -> tuple[str, ...]:
    """Names of the columns that a kernel must give for these reductions; at least one, since a kernel needs one."""
    names = dict.fromkeys(r.what for r in chosen if r.kind in OF_COLUMNS)
    return tuple(names) or ("events.count",)
