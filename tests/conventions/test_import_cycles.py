"""Imports form no cycle, even with imports inside functions and for types. Workers load no commands and no web packages."""

from __future__ import annotations

from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.conventions.parsed_sources import Syntax, syntax, syntax_of
from trunnion.packaging.setuptools_commands import PACKAGES

ROOT = Path(__file__).resolve().parents[2]
WORKERS = (
    *(f"trunnion.service.executor.{name}" for name in ("chunk_and_case_runs", "parquet_parts")),
    "trunnion.batch",
)
"""Modules that run in another process, perhaps on another machine: the cases of a batch, one run and its derivatives."""


@cache
def modules() -> dict[str, Path]:
    """Every module of the product, by its dotted name."""
    found = {}
    for name, folder in PACKAGES.items():
        for file in (ROOT / folder).rglob("*.py"):
            parts = (name, *file.relative_to(ROOT / folder).with_suffix("").parts)
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


def imports_of(source: Syntax, known: set[str]) -> set[str]:
    """Known modules that a source imports. If the source imports only modules from a package, the package itself does not count."""
    out = set(source.modules)
    for module, names in source.names:
        out |= {f"{module}.{n}" if f"{module}.{n}" in known else module for n in names}
    return out & known


@cache
def graph() -> dict[str, set[str]]:
    """Module → the modules it imports."""
    known = set(modules())
    return {m: imports_of(syntax_of(f), known) - {m} for m, f in modules().items()}


def reached(start: str) -> set[str]:
    """The module, and all modules that it imports directly or indirectly."""
    seen, todo = set(), [start]
    while todo:
        m = todo.pop()
        if m not in seen:
            seen.add(m)
            todo += graph()[m]
    return seen


def test_no_module_imports_itself_by_a_detour() -> None:
    try:
        TopologicalSorter(graph()).prepare()
    except CycleError as e:
        pytest.fail(" → ".join(e.args[1]))


def test_imports_inside_functions_and_for_types_count() -> None:
    text = "if TYPE_CHECKING:\n    import a\nelse:\n    import b\ndef f():\n    from c.d import e\n    from c import g\n"
    assert imports_of(syntax(text), {"a", "b", "c", "c.d", "c.d.e"}) == {"a", "b", "c", "c.d.e"}


@pytest.mark.parametrize("worker", WORKERS)
def test_workers_import_neither_the_command_line_nor_the_web_nor_the_store(worker: str) -> None:
    """Importing these modules would take longer than a small job."""
    theirs = ("trunnion.cli", "trunnion.fmu.cli", *(f"trunnion.service.{name}" for name in ("cli", "api", "store", "server")))
    found = sorted(m for m in reached(worker) if m.startswith(theirs))
    assert not found
