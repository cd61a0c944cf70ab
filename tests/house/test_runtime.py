"""The C sources keep the rules of the house: short files and functions, a sentence above each, names for numbers, a page of all."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
RUNTIME = ROOT / "engine" / "runtime"
SOURCES = sorted([*RUNTIME.glob("*.[ch]"), *(ROOT / "fmu" / "native").glob("*.[ch]")])
LONGER = {"fmi2.c"}
"""C files that may be longer than the rule; ``fmi2.c`` is as long as the standard's list of functions."""
OPENING = re.compile(r"^[a-zA-Z].*\)\s*\{$")
ONE_LINE = re.compile(r"^[a-zA-Z].*\)\s*\{.*\}$")


def code(file: Path) -> list[str]:
    """Lines without comments and text in quotes (as many as there are)."""
    text = re.sub(r"/\*.*?\*/", lambda m: "\n" * m.group().count("\n"), file.read_text(encoding="utf-8"), flags=re.DOTALL)
    return [re.sub(r'"(?:\\.|[^"\\])*"', '""', line) for line in text.splitlines()]


def functions(file: Path) -> Iterator[tuple[int, int]]:
    """First and last line (from 0) of every function of more than one line."""
    start = -1
    for i, line in enumerate(file.read_text(encoding="utf-8").splitlines()):
        if OPENING.match(line) and not line.startswith(("typedef", "enum", "struct")):
            start = i
        elif line == "}" and start >= 0:
            yield start, i
            start = -1


@pytest.mark.parametrize("file", SOURCES, ids=lambda f: f.name)
def test_files_and_functions_are_short(file: Path) -> None:
    lines = file.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 260 or file.name in LONGER
    assert not [(lines[a], b - a + 1) for a, b in functions(file) if b - a + 1 > 45]


@pytest.mark.parametrize("file", [f for f in SOURCES if f.parent == RUNTIME], ids=lambda f: f.name)
def test_every_function_says_what_it_does(file: Path) -> None:
    lines = file.read_text(encoding="utf-8").splitlines()
    bare = [lines[a] for a, _ in functions(file) if not lines[a - 1].rstrip().endswith("*/") and not lines[a - 1].endswith(",")]
    assert not bare


@pytest.mark.parametrize("file", SOURCES, ids=lambda f: f.name)
def test_a_tolerance_has_a_name(file: Path) -> None:
    bare = [f"{i}: {line}" for i, line in enumerate(code(file), 1)
            if re.search(r"(?<![\w.])\d+(?:\.\d+)?[eE][-+]?\d+", line) and not line.startswith("#define")]
    assert not bare


def test_the_runtimes_page_lists_every_file() -> None:
    page = (RUNTIME / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `([\w.]+)` \|", page, re.MULTILINE)
    assert sorted(listed) == sorted(f.name for f in RUNTIME.glob("*.[ch]"))


def test_a_number_has_one_name_and_a_name_one_number() -> None:
    """All files are one translation unit: a name defined again would mean one thing above that line and another below."""
    text = "".join(f.read_text(encoding="utf-8") for f in sorted(RUNTIME.glob("*.[ch]")))
    defined = Counter(re.findall(r"^#define ([A-Z_0-9]+) (?!_Pragma)", text, re.MULTILINE))
    assert [name for name, count in defined.items() if count > 1] == []
