"""Declarations of output columns: names, units, descriptions, operands, and one symbolic expression.

An expression is a function that takes operands by name and returns outputs by name. The body of the function imports the symbolic
library, so that names and units can be read without this library."""

from __future__ import annotations

import inspect
import string
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.number_declarations import ANY, Bound
from trunnion.columns.operands import Operand
from trunnion.columns.subjects import Subject, SubjectType

COMPONENT, ITEM = "component", "item"
"""Words in the name of a column. COMPONENT is the index of the quantity's component; ITEM is the index of the item, for subjects
that have several. Both indices start from 1."""


def always(_: Subject) -> bool:
    """Default of ``Quantity.given``: every subject has the quantity."""
    return True


def no_post(_: Subject) -> str:
    """Default of ``Quantity.post``: the runtime does not change the values of the column."""
    return ""


def select(**operand: Any) -> Any:
    """The default expression: the columns are consecutive components of one operand, from index ``Quantity.at`` on."""
    (value,) = operand.values()
    return value


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One output of a kind's expression, and the columns that hold the output.

    name       key for callers ("position"); a suffix after a dot distinguishes outputs with the same name ("extra.events").
    output     key of the output in the dictionary that the expression returns.
    column     template of the columns' names, with words of ``Subject.words`` in braces: "{body}.position[{component}]".
    unit       template of the unit ("{displacement}/s").
    text       template of the description.
    size       number of columns.
    at         with the expression ``select``: index of the first component in the operand.
    label      last part of the column's key, behind the subject's key.
    given      predicate: whether a subject has the quantity.
    post       processing by the runtime: "hold" (last value while the contact is open), "touch" (1 if the normal force is above
               round-off, otherwise 0), "wrap" (unwraps the angle: adds multiples of 2π so that the angle is continuous), or ""
               (none).
    bound      allowed values.
    integral   computed from powers integrated with the motion (else from state, multipliers and accelerations at the instant).
    direct     jumps when forces jump; other quantities change only by integration.
    steps      constant between events (a count, a state, the last event).
    smooth     differentiable with respect to the scene's parameters.
    runtime    computed by the runtime, not by the kernel.
    vector     "[k]" in the name counts components of a vector in space (else coordinates, contacts, states).
    reacts     depends on reactions or efforts of drives, which are not unique in a redundant loop."""

    name: str
    output: str = ""
    column: str
    unit: str
    text: str
    size: int = 1
    at: int = 0
    label: tuple[str, ...] = ()
    given: Callable[[Subject], bool] = always
    post: Callable[[Subject], str] = no_post
    bound: Bound = ANY
    integral: bool = False
    direct: bool = False
    steps: bool = False
    smooth: bool = True
    runtime: bool = False
    vector: bool = True
    reacts: bool = False

    @property
    def instantaneous(self) -> bool:
        """Whether the quantity is an expression of state, multipliers and accelerations at one instant."""
        return not (self.integral or self.runtime)


@dataclass(frozen=True, kw_only=True)
class ColumnKind:
    """Columns with a common expression, which is evaluated once for each subject.

    of           type of the subjects.
    operands     operands of the expression, by parameter name.
    quantities   outputs of the expression and their columns.
    name         name of the file in ``kinds``.
    repeats      number of items of each quantity (such as contacts); the word ``item`` in a name is replaced by an item's number.
    beside       outputs of the expression that only the runtime uses, without columns."""

    of: SubjectType
    operands: Mapping[str, Operand]
    quantities: tuple[Quantity, ...]
    expression: Callable[..., Any] = select
    name: str = ""
    repeats: Callable[[Subject], int] | None = None
    beside: tuple[str, ...] = ()

    @property
    def selects(self) -> bool:
        """Whether the columns are components of the operand."""
        return self.expression is select

    @property
    def solved(self) -> bool:
        """Whether an operand contains multipliers or accelerations, which depend on every force."""
        return any(o.solved for o in self.operands.values())


def registered(*kinds: ColumnKind) -> dict[str, ColumnKind]:
    """Kinds by name, in the given order. Raises ValueError with all faults of all declarations."""
    wrong = [f"column kind {k.name or '?'}: {fault}" for k in kinds for fault in faults(k)]
    patterns = [f"{q.column} of {k.of.name}" for k in kinds for q in k.quantities]
    for what, names in (("column kind", [k.name for k in kinds]), ("column", patterns)):
        wrong += [f"{what} {n}: declared twice" for n in dict.fromkeys(names) if names.count(n) > 1]
    if wrong:
        raise ValueError("; ".join(wrong))
    return {k.name: k for k in kinds}


def faults(kind: ColumnKind) -> list[str]:
    """Descriptions of all faults of a declaration. The list is empty for a correct declaration."""
    found = [] if kind.name.isidentifier() else ["its name is not an identifier"]
    found += [] if kind.operands else ["no operands"]
    found += [] if kind.quantities else ["no quantities"]
    found += _expression_faults(kind)
    counted = {ITEM} if kind.repeats else set()
    for q in kind.quantities:
        known = {*kind.of.words, *counted, *([COMPONENT] if q.size > 1 else [])}
        needed = {*counted, *([COMPONENT] if q.size > 1 else [])}
        found += [f"quantity {q.name or '?'}: {fault}" for fault in _quantity_faults(kind, q, known, needed)]
    return found


def _expression_faults(kind: ColumnKind) -> Iterator[str]:
    if not callable(kind.expression):
        yield "no expression"
    elif kind.selects:
        if len(kind.operands) != 1:
            yield "select takes one operand"
    elif set(inspect.signature(kind.expression).parameters) != set(kind.operands):
        yield "the expression's parameters are not its operands"


def _quantity_faults(kind: ColumnKind, q: Quantity, known: set[str], needed: set[str]) -> Iterator[str]:
    for field in ("name", "column", "unit", "text"):
        if not getattr(q, field):
            yield f"no {field}"
        unknown = _words(getattr(q, field)) - known
        if unknown:
            yield f"{field} uses words that {kind.of.name} does not have: {', '.join(sorted(unknown))}"
    if needed - _words(q.column):
        yield f"column lacks {{{'}, {'.join(sorted(needed - _words(q.column)))}}}"
    if not kind.selects and not q.output:
        yield "no output of the expression"


def _words(template: str) -> set[str]:
    return {word for _, word, _, _ in string.Formatter().parse(template) if word}
