"""The summary ``simulate`` prints: outcome, cost, ranges of the main columns, events, files."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine.basics.problems import Problem
from engine.cli.running import problem_lines
from engine.cli.terminal import coloured
from engine.simulation.certainty.stated import rough
from engine.simulation.summary import counted, ranges

if TYPE_CHECKING:
    from engine.simulation.certainty.stated import Certainty
    from engine.simulation.result import Result

FIRST_EVENTS = 6
GREEN, RED, BOLD, DIM, PLAIN = "\033[32m", "\033[31m", "\033[1m", "\033[2m", "\033[0m"


def print_summary(result: Result, files: dict[str, str], late: Sequence[Problem] = ()) -> None:
    """Print the summary; what failed goes to standard error as well."""
    color = coloured(sys.stdout)
    for line in summary_lines(result, files):
        print(plain(line) if not color else line)
    for line in problem_lines(late):
        print(line, file=sys.stderr)
    if not result.outcome.ok and not sys.stdout.isatty():
        print(f"{result.scene.name}: {result.outcome}", file=sys.stderr)


def plain(line: str) -> str:
    """The line without its colour codes."""
    for code in (GREEN, RED, BOLD, DIM, PLAIN):
        line = line.replace(code, "")
    return line


def summary_lines(result: Result, files: dict[str, str]) -> list[str]:
    """The lines of the summary: outcome, cost, ranges, events, files."""
    tone = GREEN if result.outcome.ok else RED
    title = f" — {result.scene.title}" if result.scene.title else ""
    lines = [f"{BOLD}{result.scene.name}{PLAIN}{title}", f"{tone}{result.outcome}{PLAIN}", cost(result), f"audit {result.audit}"]
    lines += [certain(result.certainty)] if result.certainty is not None else []
    lines += [f"note: {n}" for n in result.notes]
    rows = [(r.name, _number(r.low), _number(r.high), _number(r.last), *_error(result, r.name), r.unit) for r in ranges(result)]
    if rows:
        lines += ["", *table(("column", "min", "max", "last", *_error(result), "unit"), rows)]
    if result.events:
        lines += ["", *event_lines(result)]
    lines += ["", *(f"wrote {path}" for path in files.values())] if files else []
    return lines


def certain(c: Certainty) -> str:
    """What is stated about errors, in one line."""
    asked = f"accuracy {c.asked}: {'met' if c.met else 'NOT met'}; " if c.asked else ""
    shift = c.shift.max(initial=0.0)
    jumps = f"; rows near events may be off by {rough(shift)} s" if shift > 0.0 else ""
    return f"{asked}{c}{jumps} {DIM}({c.cost:.2g} runs){PLAIN}"


def _error(result: Result, name: str = "") -> tuple[str, ...]:
    """The cell of a column's largest error, or of the head; none where no errors were asked for."""
    c = result.certainty
    if c is None:
        return ()
    return (f"± {rough(c.largest(name))}" if name and np.isfinite(c.largest(name)) else "–" if name else "error",)


def cost(result: Result) -> str:
    """What the run cost in one line: steps, evaluations, seconds."""
    s = result.stats
    parts = [f"{s.steps} steps ({s.rejected} rejected)", f"{s.rhs_evaluations} evaluations"]
    parts += [f"{s.jacobians} Jacobians"] if s.jacobians else []
    most, iterations = s.counters.get("most_evaluations", 0), s.counters.get("most_iterations", 0)
    parts += [f"at most {most} evaluations and {iterations} iterations a step"] if most else []
    parts += [f"{len(result)} rows × {len(result.names)} columns", f"ran in {_seconds(s.wall_time)}"]
    parts += [f"built in {_seconds(s.build_time)}" if s.build_time else "kernel from the cache"]
    return f"{DIM}{' · '.join(parts)}{PLAIN}"


def _seconds(t: float) -> str:
    return f"{1e3 * t:.3g} ms" if t < 1.0 else f"{t:.3g} s"


def _number(x: float) -> str:
    return f"{x:.6g}"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table with aligned columns: the first and last to the left, the others to the right."""
    widths = [max(len(r[k]) for r in (head, *rows)) for k in range(len(head))]

    def line(row: Sequence[str]) -> str:
        cells = [c.ljust(w) if k in (0, len(head) - 1) else c.rjust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True))]
        return "  ".join(cells).rstrip()

    return [f"{DIM}{line(head)}{PLAIN}", *map(line, rows)]


def _ending(kind: str) -> str:
    """That of several events of a kind."""
    return "" if "_" in kind else "es" if kind.endswith("ch") else "s"


def event_lines(result: Result) -> list[str]:
    """Lines that say how many events there were and describe the first of them."""
    each = counted(result.events).items()
    counts = ", ".join(f"{n} {kind.replace('_', ' ')}{_ending(kind) if n > 1 else ''}" for kind, n in each)
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
