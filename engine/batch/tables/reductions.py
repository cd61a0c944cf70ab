"""Reductions of a case: single numbers, taken from a column over its output rows or from its events.

A reduction is written ``kind:what``, which is also the name of its column in the table. For a column, the kind is ``max``,
``min``, ``mean`` (over finite values) or ``final``. For events of one kind, or of ``any`` kind, the reduction is ``first`` (time of
the first event, s) or ``count``. The prefix ``error:`` means the global error of a reduction.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from trunnion.basics.errors import MOST, Problem, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.name_patterns import MOST_WILD, is_wild, suggestion
from trunnion.basics.renamed_words import EVENTS, current
from trunnion.kernel.interface.output_columns import Column, current_patterns, select
from trunnion.runtime.abi import EventKind

OF_COLUMNS = ("max", "min", "final", "mean")
OF_EVENTS = ("first", "count")
OF_DECISIONS = ("margin", "marginal")
"""Reductions over all decisions at a case's events: the least margin, and the number of margins below the error of the run."""
ERROR = "error"
EVENT_NUMBERS = {e.name.lower(): e.value for e in EventKind}

DEFAULTS = ("max:*.contact[*].normal_force", "max:*.friction.torque[*]", "min:*.friction.torque[*]", "final:*.q[*]", "count:any",
            "first:any")  # fmt: skip
"""Default reductions. A default reduction without a matching column is dropped."""


def event_kind(word: str) -> str:
    """The current name of a kind of event. A deprecated name is replaced; any other word, such as "any", is unchanged."""
    return EVENTS.get(word, word)


@dataclass(frozen=True)
class Reduction:
    """A reduction, which gives one number for each case.

    Attributes:
        kind: one of OF_COLUMNS, OF_EVENTS, or ERROR.
        what: name of a column, of a kind of event, or of another reduction.
        unit: unit of the number.
        description: description of the number.
    """

    kind: str
    what: str
    unit: str
    description: str

    @property
    def name(self) -> str:
        """Name of the reduction's column in the table."""
        return f"{self.kind}:{self.what}"


def reductions(texts: Sequence[str], everything: Sequence[Column], where: str = "reductions") -> tuple[Reduction, ...]:
    """The reductions that the texts name, with patterns expanded. Without texts, the default reductions. SceneError lists every
    text without a match."""
    found: dict[str, Reduction] = {}
    problems: list[Problem] = []
    names = {c.name: c for c in everything}
    wild = sum(map(is_wild, texts))
    if wild > MOST_WILD:
        problems.append(
            Problem(
                where, f"{wild} patterns with wild cards; {MOST_WILD} at most", "use fewer; one pattern with * matches many columns"
            )
        )
        texts = DEFAULTS
    for text in dict.fromkeys(texts or DEFAULTS):
        kind, sign, what = text.removeprefix(ERROR + ":").partition(":")
        if not sign or kind not in (*OF_COLUMNS, *OF_EVENTS) or not what:
            hint = "write max:PATTERN, min:, mean:, final:, or first:EVENT, count:EVENT; error: before a reduction means its error"
            problems.append(Problem(where, f"{text!r} is not a reduction", hint))
            continue
        new = _of_event(kind, what) if kind in OF_EVENTS else _of_columns(kind, what, names)
        new = [error_of(r) for r in new] if text.startswith(ERROR + ":") else new
        if not new and texts:
            problems.append(_unmatched(where, text, kind, what, names if len(problems) < MOST else ()))
        found |= {r.name: r for r in new}
    raise_problems(problems)
    return tuple(found.values())


def error_of(r: Reduction) -> Reduction:
    """The reduction that gives the global error of another reduction."""
    return Reduction(ERROR, r.name, r.unit, f"estimated bound of the global error of {r.name}; empty where no error is stated")


def with_errors(chosen: tuple[Reduction, ...], certify: bool) -> tuple[Reduction, ...]:
    """The reductions. With ``certify``, also the errors of all reductions."""
    if not certify:
        return chosen
    return tuple(dict.fromkeys((*chosen, *(error_of(r) for r in chosen if r.kind != ERROR))))


def about_errors(chosen: Iterable[Reduction]) -> bool:
    """Whether any of the reductions is an error of another reduction."""
    return any(r.kind == ERROR for r in chosen)


def _of_event(kind: str, what: str) -> list[Reduction]:
    event = current("event", EVENTS, what)
    if event != "any" and event not in EVENT_NUMBERS:
        return []
    text = event.replace("_", " ") if event != "any" else "event of any kind"
    if kind == "first":
        return [Reduction(kind, what, "s", f"time of the first {text}")]
    return [Reduction(kind, what, "1", f"number of events: {text}")]


def _of_columns(kind: str, pattern: str, names: Mapping[str, Column]) -> list[Reduction]:
    said = {"max": "largest", "min": "smallest", "final": "last", "mean": "mean"}[kind]
    (pattern,) = current_patterns((pattern,), list(names.values()))
    chosen = select(list(names.values()), (pattern,)) if is_wild(pattern) else [names[pattern]] if pattern in names else []
    return [Reduction(kind, c.name, c.unit, f"{said} {c.description}") for c in chosen]


def _unmatched(where: str, text: str, kind: str, what: str, names: Iterable[str]) -> Problem:
    known = [*EVENT_NUMBERS, "any"] if kind in OF_EVENTS else list(names)
    things, hint = "column", "see `trunnion check SCENE --columns`"
    if kind in OF_EVENTS:
        things, hint = "kind of event", f"one of {', '.join(known)}"
    return Problem(where, f"{text!r} matches no {things}", suggestion(what[:80], known, hint, 3, 0.4))


def wanted_columns(chosen: Sequence[Reduction]) -> tuple[str, ...]:
    """Names of the columns that the kernel must compute for these reductions. The list has at least one name."""
    names = dict.fromkeys(r.what for r in chosen if r.kind in OF_COLUMNS)
    return tuple(names) or ("events.count",)
