"""The columns of a scene, from the registry of columns: names (reference/columns.md), units, origin. This module does not load the
symbolic library."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.name_patterns import matcher
from trunnion.basics.number_declarations import ANY, Bound
from trunnion.basics.renamed_words import current_column, current_pattern
from trunnion.columns.declaration import COMPONENT, ITEM, ColumnKind, Quantity
from trunnion.columns.registry import REGISTRY, shown, subjects
from trunnion.columns.subjects import Subject
from trunnion.system.structure.bodies_and_joints import System


@dataclass(frozen=True)
class Column:
    """A column with name, unit and description. kind: kind of the column. subject: key of the subject. index: index of the kind's
    quantity. item: item of the subject, None if there is only one. component: None for a scalar. post: post-processing by the
    runtime (``Quantity.post``), or "". bound: range of the values."""

    name: str
    unit: str
    description: str
    kind: str
    subject: tuple
    number: int = 0
    item: int | None = None
    component: int | None = None
    post: str = ""
    bound: Bound = ANY

    @property
    def quantity(self) -> Quantity:
        """The quantity that the column shows."""
        return REGISTRY[self.kind].quantities[self.number]

    @property
    def key(self) -> tuple:
        """Identifier of the column within a system: quantity (its name up to the first dot), subject, item, label and component."""
        if self.kind not in REGISTRY:
            return (self.kind, *self.subject)
        q = self.quantity
        item, component = ([] if k is None else [k] for k in (self.item, self.component))
        return (q.name.partition(".")[0], *self.subject, *item, *q.label, *component)

    @property
    def place(self) -> int:
        """Index of the column within the output of its kind. The output contains all items of the subject."""
        return self.quantity.at + (self.item or 0) * self.quantity.size + (self.component or 0)


def columns(system: System) -> list[Column]:
    """Every column of the system, in order."""
    return [c for kind, s in subjects(system) for c in _columns(kind, s)]


def _columns(kind: ColumnKind, s: Subject) -> list[Column]:
    out = []
    for number, item, component in shown(kind, s):
        q = kind.quantities[number]
        words = s.words | {ITEM: str((item or 0) + 1), COMPONENT: str((component or 0) + 1)}
        name, unit, text = q.column.format_map(words), q.unit.format_map(words), q.text.format_map(words)
        out.append(Column(name, unit, text, kind.name, s.key, number, item, component, q.post(s), q.bound))
    return out


def select(all_columns: list[Column], patterns: tuple[str, ...]) -> list[Column]:
    """Columns whose name matches one of the patterns. Patterns are those of the shell, except that "[k]" is an index and not a
    character class."""
    wanted = matcher(current_patterns(patterns, all_columns))
    return [c for c in all_columns if wanted(c.name)]


def current_patterns(patterns: Iterable[str], all_columns: Sequence[Column]) -> list[str]:
    """The patterns, with current words in place of deprecated words. Deprecated words are replaced, with a warning, only in a
    pattern that matches no column."""
    def matches(pattern: str) -> bool:
        return any(map(matcher((pattern,)), (c.name for c in all_columns)))

    return [p if current_column(p) == p else current_pattern(p, matches(p)) for p in patterns]


def needs_quadratures(chosen: list[Column]) -> bool:
    """Whether any chosen column is an integral."""
    return any(c.quantity.integral for c in chosen)
