"""Exit codes, and reports of problems and failures in words, without a traceback."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Sequence

from trunnion.basics.errors import Problem

DONE, FAILED, WRONG_USE = 0, 1, 2


def problems_end(problems: Sequence[Problem], as_json: bool) -> int:
    """Report all problems, and return the exit code for wrong use."""
    if as_json:
        listed = [p.as_dict() for p in problems]
        print_json({"exit_code": WRONG_USE, "problem_count": sum(p.count for p in problems), "problems": listed})
    else:
        error_lines(problem_lines(problems))
    return WRONG_USE


def problem_lines(problems: Iterable[Problem]) -> list[str]:
    """Place, cause and remedy of each problem, as lines."""
    lines = []
    for p in problems:
        place = f"{p.file}:{p.line}: " if p.file and p.line else f"{p.file}: " if p.file else ""
        lines.append(f"{place}{p.where}: {p.what}")
        if p.hint:
            lines.append(f"    → {p.hint}")
    return lines


def failure_end(text: str, as_json: bool) -> int:
    """Report a failure, and return its exit code."""
    if as_json:
        print_json({"exit_code": FAILED, "error": text})
    else:
        error_lines(text.splitlines())
    return FAILED


def error_lines(lines: Iterable[str]) -> None:
    """Print lines on standard error."""
    for line in lines:
        print(line, file=sys.stderr)


def print_json(data: object) -> None:
    """Print one JSON document on standard output."""
    from trunnion.basics.json_values import finite

    print(json.dumps(finite(data), ensure_ascii=False, indent=2))
