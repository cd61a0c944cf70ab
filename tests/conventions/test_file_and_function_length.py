"""Python files and functions of the project are short. A list in this file names each longer one with its reason."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MOST_LINES, MOST_OF_A_FUNCTION = 400, 45
LONGER_FUNCTIONS: dict[str, str] = {}
"""Functions that may be longer, as ``file::name``, and the reason."""


def files() -> Iterator[tuple[str, str]]:
    """(name, text) of every Python file of the project."""
    for top in ("engine", "fmu", "service", "tests", "models"):
        for file in sorted((ROOT / top).rglob("*.py")):
            yield file.relative_to(ROOT).as_posix(), file.read_text(encoding="utf-8")


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements below a node. The walk skips expressions: no function has a statement inside an expression, and most nodes of
    a file are expressions."""
    for below in ast.iter_child_nodes(node):
        if isinstance(below, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield below
            yield from statements(below)


def lengths(name: str, text: str) -> Iterator[tuple[str, int]]:
    """(``file::name``, lines) of every function of a file, without its decorators and its docstring."""
    for node in statements(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0]
            assert node.end_lineno is not None
            assert first.end_lineno is not None
            words = first.end_lineno - first.lineno + 1 if ast.get_docstring(node) else 0
            yield f"{name}::{node.name}", node.end_lineno - node.lineno + 1 - words


def test_files_are_short() -> None:
    assert not [name for name, text in files() if len(text.splitlines()) > MOST_LINES]


def test_functions_are_short_or_say_why_not() -> None:
    long = {name for file, text in files() for name, n in lengths(file, text) if n > MOST_OF_A_FUNCTION}
    assert long == set(LONGER_FUNCTIONS)


def test_a_long_function_is_seen() -> None:
    text = "class A:\n    async def f(self):\n" + "        pass\n" * MOST_OF_A_FUNCTION
    assert list(lengths("a.py", text)) == [("a.py::f", MOST_OF_A_FUNCTION + 1)]
