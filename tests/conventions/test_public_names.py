"""The public names of ``trunnion`` are grouped in its docstring, are loaded on first use, and are visible to type checkers."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest

import trunnion

SOURCE = ast.parse(Path(trunnion.__file__).read_text(encoding="utf-8"))
CHEAP = "import sys, trunnion; print(sorted(m for m in sys.modules if m.startswith(('trunnion', 'numpy'))))"


def imported_for_types() -> dict[str, str]:
    """Name → module for every import from the package's own modules under ``TYPE_CHECKING`` in ``trunnion/__init__.py``."""
    block = next(n for n in SOURCE.body if isinstance(n, ast.If))
    froms = [n for n in block.body if isinstance(n, ast.ImportFrom)]
    return {a.name: (n.module or "").removeprefix("trunnion.") for n in froms for a in n.names}


def test_docstring_lists_every_public_name_in_order() -> None:
    assert re.findall(r"^    (\w+): .+\.$", trunnion.__doc__ or "", re.MULTILINE) == trunnion.__all__


def test_every_public_name_loads() -> None:
    assert all(getattr(trunnion, name) is not None for name in trunnion.__all__)
    assert set(trunnion.__all__) <= set(dir(trunnion))


def test_type_checkers_see_the_names_that_load() -> None:
    assert imported_for_types() == trunnion._HOMES
    assert set(trunnion._HOMES) == set(trunnion.__all__)


def described(text: str) -> set[str]:
    """The names in the lists of arguments and attributes of a docstring."""
    lists = re.findall(r"(?ms)^(?:Args|Attributes):\n((?: +.*\n?|\n)+)", text)
    return {name.strip(" *") for found in lists for line in re.findall(r"(?m)^    ([\w, *]+):", found) for name in line.split(",")}


# the fields of Scene are described in the reference of scene keys
@pytest.mark.parametrize("name", [n for n in trunnion.__all__ if n != "Scene"])
def test_every_argument_and_attribute_of_a_public_name_is_described(name: str) -> None:
    public = getattr(trunnion, name)
    if inspect.isfunction(public):
        needed = set(inspect.signature(public).parameters)
    else:
        needed = {f.name for f in fields(public) if not f.name.startswith("_")} if is_dataclass(public) else set()
    assert needed <= described(inspect.getdoc(public) or "")


def test_import_loads_no_other_module() -> None:
    told = subprocess.run([sys.executable, "-c", CHEAP], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "['trunnion']"
