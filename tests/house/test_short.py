"""Python files and functions of the project are short; each that is longer is listed here with its reason."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MOST_LINES, MOST_OF_A_FUNCTION = 260, 45
LONGER = {
    "tests/engine/test_cache.py": "every claim about one cache, over one set of helpers that build small libraries",
    "tests/engine/test_integrators.py": "every claim about methods, over one set of helpers that step test equations",
}
"""Files that may be longer, and why."""
LONGER_FUNCTIONS: dict[str, str] = {}
"""Functions that may be longer, as ``file::name``, and why."""


def files() -> Iterator[tuple[str, str]]:
    """(name, text) of every Python file of the project."""
    for top in ("engine", "fmu", "service", "tests", "models"):
        for file in sorted((ROOT / top).rglob("*.py")):
            yield file.relative_to(ROOT).as_posix(), file.read_text(encoding="utf-8")


def lengths(name: str, text: str) -> Iterator[tuple[str, int]]:
    """(``file::name``, lines) of every function of a file, its decorators apart."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            assert node.end_lineno is not None
            yield f"{name}::{node.name}", node.end_lineno - node.lineno + 1


def test_files_are_short_or_say_why_not() -> None:
    assert {name for name, text in files() if len(text.splitlines()) > MOST_LINES} == set(LONGER)


def test_functions_are_short_or_say_why_not() -> None:
    long = {name for file, text in files() for name, n in lengths(file, text) if n > MOST_OF_A_FUNCTION}
    assert long == set(LONGER_FUNCTIONS)


def test_a_long_function_is_seen() -> None:
    text = "class A:\n    async def f(self):\n" + "        pass\n" * MOST_OF_A_FUNCTION
    assert list(lengths("a.py", text)) == [("a.py::f", MOST_OF_A_FUNCTION + 1)]
