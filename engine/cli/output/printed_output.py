"""Printed lines: aligned tables, colours, results of commands."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from trunnion.basics.number_declarations import ZERO_BELOW
from trunnion.cli.output.exit_codes_and_errors import print_json
from trunnion.cli.output.terminal_capabilities import has_colours

GREEN, RED, BOLD, DIM, PLAIN = "\033[32m", "\033[31m", "\033[1m", "\033[2m", "\033[0m"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table. The first and the last column are aligned left, the others right."""
    widths = [max(len(r[k]) for r in (head, *rows)) for k in range(len(head))]

    def line(row: Sequence[str]) -> str:
        cells = [c.ljust(w) if k in (0, len(head) - 1) else c.rjust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True))]
        return "  ".join(cells).rstrip()

    return [f"{DIM}{line(head)}{PLAIN}", *map(line, rows)]


def number(x: float, digits: int = 6) -> str:
    """A number as text; a magnitude below ``ZERO_BELOW`` is 0."""
    return f"{0.0 if abs(x) < ZERO_BELOW else x:.{digits}g}"


def outcome_counts(counts: Mapping[str, int]) -> str:
    """Number of cases by outcome, the most frequent first."""
    return ", ".join(f"{n} {name}" for name, n in sorted(counts.items(), key=lambda c: -c[1]))


def plain(line: str) -> str:
    """The line without its colour codes."""
    for code in (GREEN, RED, BOLD, DIM, PLAIN):
        line = line.replace(code, "")
    return line


def print_lines(lines: Iterable[str]) -> None:
    """Print lines, with colours only on a terminal that shows colours."""
    for line in lines:
        print(line if has_colours(sys.stdout) else plain(line))


def print_result(as_json: bool, code: int, document: Mapping[str, Any], lines: Iterable[str]) -> int:
    """Print the result of a command as one JSON document or as lines. Returns the exit code."""
    if as_json:
        print_json({"exit_code": code, **document})
    else:
        print_lines(lines)
    return code


def print_answer(
    as_json: bool, code: int, document: Mapping[str, Any], lines: Iterable[str], files: Mapping[str, Any] | Sequence[Any]
) -> int:
    """Print a result as ``print_result`` does, with the files that the command wrote. files: paths by kind, or a list of paths;
    None for a file that was not requested."""
    named = {k: str(f) for k, f in files.items() if f} if isinstance(files, Mapping) else [str(f) for f in files if f]
    paths = named.values() if isinstance(named, dict) else named
    return print_result(as_json, code, {**document, "files": named}, [*lines, *(f"wrote {f}" for f in paths)])
