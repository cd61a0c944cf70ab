"""Generated pages of the reference: columns, events, outcomes, and the table of laws in ``notation.md``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

COLUMNS = """# Columns

This page lists the output columns in the order of a result. Words in capitals are names and numbers of the scene. Indices count
from 1. FMU variables and reductions of batches have the same names. `--outputs PATTERN` selects columns; `ball.*` selects all of
joint `ball`.

| column | unit | content |
|---|---|---|
"""
STANDING_FOR = {
    "JOINT.STEM[": "JOINT.DEVICE.effort[",
    "the WHAT of": "the DEVICE of",
    "friction.PLACE": "friction.torque[NUMBER]`, `JOINT.friction.force`, `JOINT.friction.force[NUMBER]",
    "friction WHAT": "friction torque or force",
    "DISPLACEMENT": "rad or m",
    "EFFORT": "N*m or N",
    "NUMBERRADIUS": "NUMBER",
    " (SENSE)": "",
}
"""Words of declarations that stand for one of several texts in a scene."""
EVENTS = """# Events

A run reports these kinds of events: `result.events` in Python, the list in the summary, `events.*` in tables and FMUs. Each event
has a time, a joint and a part (the number of the friction pair in this joint, from 1). For every contact of this pair, the event
has the angle before, the angle after, and the angle by which the normal turned. Reductions of batches count and find events:
`count:slip`, `first:stick`.

| event | meaning |
|---|---|
"""
OUTCOMES = """# Outcomes

A run ends with one of these outcomes. Each outcome names time, joint and remedy. The result has all rows up to this time.

| outcome | joint, and numbers reported | remedy |
|---|---|---|
| `done` | | none needed: the end time was reached |
"""
DETAILS = {
    "jammed": "the friction pair: `part`, `friction`",
    "inconsistent": "the friction pair",
    "no_solution": "the joint with the most friction",
    "open_loop": "the joint where the loop is cut; `independence`",
    "dead_centre": "the first driven joint of the loop, else the joint where it is cut",
    "gimbal_lock": "a universal joint of the loop, else the joint where it is cut; `independence`",
    "overlap_lost": "the joint",
    "penetration": "the joint that only pushes; `depth` (m)",
    "not_finite": "the joint that moves fastest",
    "no_inertia": "the joint whose freedom takes part most in the motion",
    "inaccurate": "the joint of an event just before most of the error; `energy` (J, gained), `turned_over`, `share`",
}
"""The joint that an outcome names, and the numbers that it reports."""
OUTCOMES_END = """
A contact that separates does not end a run: the contact continues at the other side of its clearance, with the event
`separation`. If several sets of modes satisfy the friction laws, the decision prefers sticking; a note and
`certificate.indeterminate` say so. [End of reach](../theory/loops.md#end-of-reach) explains `open_loop` and `gimbal_lock`,
[Jams](../theory/friction.md#jams) explains `jammed`. """


def columns_text() -> str:
    """The page of columns."""
    rows = (f"| `{name}` | {unit} | {cell(text)} |\n" for name, unit, text in reference())
    return COLUMNS + "".join(readable(row) for row in rows)


def reference() -> Iterator[tuple[str, str, str]]:
    """(name, unit, description) of every column, for the printed reference. Placeholders in capitals replace the subjects:
    ``BODY.position[COMPONENT]``."""
    from trunnion.columns.declaration import COMPONENT, ITEM
    from trunnion.columns.registry import REGISTRY

    for kind in REGISTRY.values():
        words = {w: w.upper() for w in (*kind.of.words, ITEM, COMPONENT)}
        for q in kind.quantities:
            yield q.column.format_map(words), q.unit.format_map(words), q.text.format_map(words)


def readable(row: str) -> str:
    """A row whose placeholder words are replaced by the texts for which they stand."""
    for word, meaning in STANDING_FOR.items():
        row = row.replace(word, meaning)
    return row


def events_text() -> str:
    """The page of events."""
    from trunnion.runtime.abi.enumerations import EventKind

    return EVENTS + "".join(f"| `{kind.name.lower()}` | {cell(kind.about)} |\n" for kind in EventKind)


def outcomes_text() -> str:
    """The page of outcomes."""
    from trunnion.simulation.results.outcome import ADVICE

    rows = (f"| `{name}` | {DETAILS.get(name, '')} | {cell(advice)} |\n" for name, advice in sorted(ADVICE.items()))
    return OUTCOMES + "".join(rows) + OUTCOMES_END


def cell(text: str) -> str:
    """Text as the content of a table's cell."""
    return text.replace("|", "\\|")


def law_table() -> str:
    """The friction laws as a Markdown table."""
    from trunnion.elements.friction import DEFAULT
    from trunnion.elements.friction import REGISTRY as LAWS

    lines = ["| law | k while sliding | at rest | numbers |", "|---|---|---|---|"]
    for name, law in LAWS.items():
        called = f"`{name}`" + (" (default)" if name == DEFAULT else "")
        formula, at_rest = map(cell, (law.formula, law.at_rest))
        lines.append(f"| {called} | {formula} | {at_rest} | {', '.join(map(_number_cell, law.numbers))} |")
    return "\n".join(lines)


def _number_cell(n: Any) -> str:
    """A number in the table: symbol, unit, default, and whether it is required."""
    letter = n.symbol if n.symbol != n.name else ""
    unit = "" if n.unit == "1" else n.unit
    default = f"default {n.default:g}" if n.default is not None else ""
    about = ", ".join(x for x in (letter, unit, default, n.needed_with and f"with `{n.needed_with}`") if x)
    optional = "optional " if not n.needed and not n.needed_with else ""
    return f"{optional}`{n.name}`" + (f" ({about})" if about else "")


def notation_text(page: Path) -> str:
    """The page of notation with the table of friction laws that their declarations give."""
    return re.sub(r"(?m)^\| law \|.*\n(?:\|.*\n)+", lambda _: law_table() + "\n", page.read_text(encoding="utf-8"), count=1)
