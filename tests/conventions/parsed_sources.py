"""Texts and imports of Python sources. Each test process parses a file only once for all tests of conventions."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path


@dataclass(frozen=True)
class Syntax:
    """Parts of a source.

    Attributes:
        texts: all string constants.
        shown: string constants that a machine or a user reads, without docstrings and the names in ``__all__``.
        modules: modules of ``import`` statements.
        names: (module, names) of ``from`` statements.
    """

    texts: tuple[str, ...]
    shown: tuple[str, ...]
    modules: tuple[str, ...]
    names: tuple[tuple[str, tuple[str, ...]], ...]

    def imported(self) -> set[str]:
        """All modules that are imported, and all names with their modules: ``a``, ``a.b``."""
        return {*self.modules, *(name for m, of in self.names for name in (m, *(f"{m}.{n}" for n in of)))}


def syntax(text: str) -> Syntax:
    """The parts of a source, given as text."""
    texts, shown, modules, names = list[str](), list[str](), list[str](), list[tuple[str, tuple[str, ...]]]()
    skipped = set[int]()
    for n in ast.walk(ast.parse(text)):  # ast.walk yields parents before their children
        if isinstance(n, ast.Expr):
            skipped.add(id(n.value))
        elif isinstance(n, ast.Assign) and isinstance(n.targets[0], ast.Name) and n.targets[0].id == "__all__":
            skipped |= {id(x) for x in ast.walk(n)}
        elif isinstance(n, ast.Constant) and isinstance(n.value, str):
            texts.append(n.value)
            shown += [n.value] * (id(n) not in skipped)
        elif isinstance(n, ast.Import):
            modules += [a.name for a in n.names]
        elif isinstance(n, ast.ImportFrom) and n.module:
            names.append((n.module, tuple(a.name for a in n.names)))
    return Syntax(tuple(texts), tuple(shown), tuple(modules), tuple(names))


@cache
def syntax_of(file: Path) -> Syntax:
    """The parts of the source in a file."""
    return syntax(file.read_text(encoding="utf-8"))
