"""The summary that ``simulate`` prints: outcome, cost, ranges of the main columns, events, files."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from trunnion.basics.errors import Problem
from trunnion.cli.output.exit_codes_and_errors import error_lines, problem_lines
from trunnion.cli.output.printed_output import BOLD, DIM, GREEN, PLAIN, RED, number, print_lines, table
from trunnion.simulation.results.error_statement import rough
from trunnion.simulation.results.summary import column_ranges, count_events

if TYPE_CHECKING:
    from trunnion.simulation.results.error_statement import Certainty
    from trunnion.simulation.results.result import Result

FIRST_EVENTS = 6
MOST_COLUMNS = 40
"""Largest count of columns whose ranges are shown."""


def print_summary(
    result: Result, files: Mapping[str, str], late: Sequence[Problem] = (), columns: Sequence[str] | None = None
) -> None:
    """Print the summary. A failure is also printed on standard error. columns: columns whose ranges are shown; None means the main
    columns."""
    print_lines(summary_lines(result, files, columns))
    error_lines(problem_lines(late))
    if not result.outcome.ok and not sys.stdout.isatty():
        error_lines([f"{result.scene.name}: {result.outcome}"])


def summary_lines(result: Result, files: Mapping[str, str], columns: Sequence[str] | None = None) -> list[str]:
    """Outcome, cost, ranges, events and files, as lines."""
    tone = GREEN if result.outcome.ok else RED
    title = f" — {result.scene.title}" if result.scene.title else ""
    lines = [f"{BOLD}{result.scene.name}{PLAIN}{title}", f"{tone}{result.outcome}{PLAIN}", cost(result), f"audit {result.audit}"]
    lines += [error_line(result.certainty)] if result.certainty is not None else []
    lines += [f"note: {n}" for n in result.notes]
    shown = columns if columns is None else list(columns[:MOST_COLUMNS])
    rows = [
        (r.name, number(r.low), number(r.high), number(r.last), *error_cells(result, r.name), r.unit)
        for r in column_ranges(result, shown)
    ]
    if rows:
        lines += ["", *table(("column", "min", "max", "last", *error_cells(result), "unit"), rows)]
    lines += [f"… and {len(columns) - MOST_COLUMNS} more"] if columns is not None and len(columns) > MOST_COLUMNS else []
    if result.events:
        lines += ["", *event_lines(result)]
    return lines + (["", *(f"wrote {path}" for path in files.values())] if files else [])


def error_line(c: Certainty) -> str:
    """One line about the estimated errors."""
    requested = f"accuracy {c.asked}: {'met' if c.met else 'NOT met'}; " if c.asked else ""
    shift = c.shift.max(initial=0.0)
    jumps = f"; values near events may belong to a time up to {rough(shift)} s earlier or later" if shift > 0.0 else ""
    return f"{requested}{c}{jumps} {DIM}({c.cost:.2g} runs){PLAIN}"


def error_cells(result: Result, name: str = "") -> tuple[str, ...]:
    """The table cell with a column's largest error. Without ``name``, the result is the cell of the table's head. If the run has no
    error estimates, there is no cell."""
    c = result.certainty
    if c is None:
        return ()
    return (f"± {rough(c.largest(name))}" if name and np.isfinite(c.largest(name)) else "–" if name else "error",)


def cost(result: Result) -> str:
    """Cost of the run in one line: steps, evaluations, seconds."""
    s = result.stats
    parts = [f"{s.steps} steps ({s.rejected} rejected)", f"{s.rhs_evaluations} evaluations"]
    parts += [f"{s.jacobians} Jacobians"] if s.jacobians else []
    most, iterations = s.counters.get("most_evaluations", 0), s.counters.get("most_iterations", 0)
    parts += [f"at most {most} evaluations and {iterations} iterations per step"] if most else []
    parts += [f"{len(result)} rows × {len(result.names)} columns", f"ran in {duration(s.wall_time)}"]
    parts += [f"built in {duration(s.build_time)}" if s.build_time else "kernel from the cache"]
    return f"{DIM}{' · '.join(parts)}{PLAIN}"


def duration(t: float) -> str:
    """A time, s, as text."""
    return f"{1e3 * t:.3g} ms" if t < 1.0 else f"{t:.3g} s"


def event_lines(result: Result) -> list[str]:
    """Counts of events by kind, and a table of the first events."""
    counts = ", ".join(f"{kind.replace('_', ' ')} {n}" for kind, n in count_events(result.events).items())
    rows = []
    errors = result.certainty.event_errors if result.certainty is not None else ()
    for i, e in enumerate(result.events[:FIRST_EVENTS]):
        turns = ", ".join(f"{math.degrees(a):.4g}°" for a in e.turn if math.isfinite(a))
        where = f"{e.joint}[{e.part}]" if any(x.part > 1 for x in result.events if x.joint == e.joint) else e.joint
        kind = e.kind.replace("_", " ") + (" (marginal)" if e.marginal else "")
        off = (f"± {rough(errors[i])}",) if errors else ()
        rows.append((f"{e.time:.6f}", *off, kind, where, turns))
    more = len(result.events) - len(rows)
    head = ("time, s", *(("error, s",) if errors else ()), "event", "joint", "contact normals turn by")
    return [f"events: {counts}", *table(head, rows), *([f"… and {more} more"] if more else [])]
