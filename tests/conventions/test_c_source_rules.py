"""The C sources follow the project's rules: stages in one order, short files and functions, one name for each number."""

from __future__ import annotations

import re
import shutil
from collections import Counter
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import pytest

from trunnion.fmu.c_text.dead_code_and_ascii import definitions
from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.kernel.shared_libraries import RUNTIME, write_headers
from trunnion.runtime.abi.header_constants import number

ROOT = Path(__file__).resolve().parents[2]
UNIT = RUNTIME / "runtime.c"
NATIVE = ROOT / "fmu" / "native"
UNITS = (UNIT, NATIVE / "translation_unit.c", NATIVE / "pythonfmu_loader.c")
"""Files that include other C files. ``translation_unit.c`` is the C shell of FMUs and C libraries."""
SOURCES = sorted([*RUNTIME.rglob("*.[ch]"), *NATIVE.rglob("*.[ch]")])
STAGES = ("base", "constraints", "friction", "evaluate", "integrators", "checks", "output", "modes", "events", "diagnosis",
          "time_stepping", "stepping", "hosts")  # fmt: skip
"""Folders of the runtime in their order. A stage calls only earlier stages."""
MOST_LINES, MOST_OF_A_FUNCTION = 400, 45
LONGER = {"fmi2_functions.c"}
"""C files that may be longer; ``fmi2_functions.c`` is as long as the standard's list of functions."""
OPENING = re.compile(r"^[a-zA-Z].*\)\s*\{$")
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
DEFINED = re.compile(r"^#define (\w+)[ \t]+\(?-?[\d.]", re.MULTILINE)
FORWARD = re.compile(r"^static (?!inline)[^;{}=#()]*\b(\w+)\([^;{}]*\);", re.MULTILINE)
PROTOTYPE = re.compile(r"^(?!typedef|return|else|#)[A-Za-z_][\w *]*?\b(tr_\w+)\([^;{}=]*\);", re.MULTILINE)


def name_of(file: Path) -> str:
    """Name of a file: its path in the runtime for a file of the runtime, else its name."""
    return file.relative_to(RUNTIME).as_posix() if file.is_relative_to(RUNTIME) else file.name


def code(text: str) -> str:
    """C text without comments and quoted text, with the same number of lines."""
    bare = re.sub(r"/\*.*?\*/", lambda m: "\n" * m.group().count("\n"), text, flags=re.DOTALL)
    return re.sub(r'"(?:\\.|[^"\\\n])*"', '""', bare)


def functions(file: Path) -> Iterator[tuple[int, int]]:
    """First and last line (from 0) of every function of more than one line."""
    start = -1
    for i, line in enumerate(file.read_text(encoding="utf-8").splitlines()):
        if OPENING.match(line) and not line.startswith(("typedef", "enum", "struct")):
            start = i
        elif line == "}" and start >= 0:
            yield start, i
            start = -1


@lru_cache(maxsize=3)
def order(unit: Path = UNIT) -> list[str]:
    """Files of a unit, by default the runtime, in the order in which they are compiled."""
    return [f for f in INCLUDE.findall(unit.read_text(encoding="utf-8")) if f.endswith(".c")]


# -- Stages ---------------------------------------------------------------------------------------------------------------------


def test_the_unit_lists_every_file_once_stage_by_stage() -> None:
    assert sorted(order()) == sorted(name_of(f) for f in RUNTIME.rglob("*.c") if f != UNIT)
    assert tuple(dict.fromkeys(f.partition("/")[0] for f in order())) == STAGES
    stages = [STAGES.index(f.partition("/")[0]) for f in order()]
    assert stages == sorted(stages)


def test_only_units_include_c_files() -> None:
    found = {name_of(f): INCLUDE.findall(f.read_text(encoding="utf-8")) for f in SOURCES if f not in UNITS}
    assert {f: i for f, i in found.items() if any(x.endswith(".c") for x in i)} == {}


def test_functions_are_declared_in_the_headers_of_stages_only() -> None:
    found = {name_of(f): PROTOTYPE.findall(code(f.read_text(encoding="utf-8"))) for f in RUNTIME.rglob("*.[ch]")}
    headers = {f"{stage}/{stage}.h" for stage in STAGES} | {name_of(f) for f in (RUNTIME / "base").glob("*.h")}
    assert {f: names for f, names in found.items() if names and f not in headers} == {}


def test_every_file_of_the_fmu_shell_is_in_one_unit_and_declares_nothing_forward() -> None:
    files = [f for f in NATIVE.rglob("*.c") if f not in UNITS and f.name != "windows_libc.c"]
    assert sorted(f for unit in UNITS[1:] for f in order(unit)) == sorted(f.relative_to(NATIVE).as_posix() for f in files)
    forward = {f.name: FORWARD.findall(code(f.read_text(encoding="utf-8"))) for f in NATIVE.rglob("*.[ch]")}
    assert {f: names for f, names in forward.items() if names} == {}


@pytest.mark.parametrize("unit", UNITS[1:], ids=name_of)
def test_no_call_in_the_fmu_shell_goes_to_a_later_line(unit: Path) -> None:
    text = {f: code((NATIVE / f).read_text(encoding="utf-8")) for f in order(unit)}
    made = [(f, d) for f in text for d in definitions(text[f])]
    place: dict[str, int] = {}
    for i, (_, d) in enumerate(made):
        place.setdefault(d.name, i)
    names = [(i, d.name, set(re.findall(r"\w+", text[f][d.body : d.end])) & place.keys()) for i, (f, d) in enumerate(made)]
    assert sum(len(called) for _, _, called in names) >= 15
    assert [(name, later) for i, name, called in names for later in called if place[later] > i] == []


def calls() -> Iterator[tuple[str, str, str, str]]:
    """Calls in the runtime: (calling function, its file, called function, file of the called function)."""
    text = {name_of(f): code(f.read_text(encoding="utf-8")) for f in RUNTIME.rglob("*.[ch]")}
    made = {f: list(definitions(t)) for f, t in text.items()}
    home = {d.name: f for f, ds in made.items() for d in ds}
    for f, ds in made.items():
        for d in ds:
            for name in set(re.findall(r"\btr_\w+", text[f][d.body : d.end])) & home.keys():
                yield d.name, f, name, home[name]


def test_no_call_goes_to_a_later_file() -> None:
    place = {f: i for i, f in enumerate(order())}
    found = list(calls())
    assert len(found) > 2000
    against = [c for c in found if place.get(c[3], -1) > place.get(c[1], len(place))]
    assert against == []


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_compiles_against_the_headers_of_earlier_ones(stage: str, tmp_path: Path) -> None:
    assert compiles_alone(stage, tmp_path) == ""


def test_a_stage_that_calls_a_later_one_does_not(tmp_path: Path) -> None:
    later = 'int tr_wrong(tr_sim *s) { return tr_solve_in_modes(s); }\n'
    assert "tr_solve_in_modes" in compiles_alone("constraints", tmp_path, later)


def compiles_alone(stage: str, folder: Path, more: str = "") -> str:
    """Compiler messages for a stage's files, followed by the text `more`, when headers of later stages are unavailable."""
    write_headers(folder)
    for known in STAGES[: STAGES.index(stage) + 1]:
        shutil.copytree(RUNTIME / known, folder / known, ignore=shutil.ignore_patterns("" if known == stage else "*.c"))
    unit = folder / "stage.c"
    unit.write_text("".join(f'#include "{f}"\n' for f in order() if f.startswith(f"{stage}/")) + more)
    words = ["-Werror=implicit-function-declaration", "-O0", "-c", str(unit), f"-I{folder}", "-o", str(folder / "stage.o")]
    try:
        c_compiler.run([*c_compiler.host().flags(), *c_compiler.FLAGS, *words], library_cache.cache_folder())
    except c_compiler.CompilerError as e:
        return str(e)
    return ""


def test_the_runtimes_page_reports_its_stages_in_order() -> None:
    page = (RUNTIME / "README.md").read_text(encoding="utf-8")
    assert tuple(re.findall(r"^\| \[`(\w+)`\]", page, re.MULTILINE)) == STAGES


# -- Files, functions, numbers --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("file", SOURCES, ids=name_of)
def test_files_and_functions_are_short(file: Path) -> None:
    lines = file.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= MOST_LINES or file.name in LONGER
    assert not [(lines[a], b - a + 1) for a, b in functions(file) if b - a + 1 > MOST_OF_A_FUNCTION]


@pytest.mark.parametrize("file", SOURCES, ids=name_of)
def test_a_tolerance_has_a_name(file: Path) -> None:
    lines = code(file.read_text(encoding="utf-8")).splitlines()
    bare = [f"{i}: {line}" for i, line in enumerate(lines, 1)
            if re.search(r"(?<![\w.])\d+(?:\.\d+)?[eE][-+]?\d+", line) and not line.startswith("#define")]
    assert not bare


SHARED = ("base/tolerances.h", "base/stick_rule.h")
"""Files that define constants for several files."""
ENGINE = ROOT / "engine"
OTHERS = [*(ENGINE / "kernel").rglob("*.hpp"), *(ROOT / "fmu" / "native").rglob("*.[ch]"), *ENGINE.rglob("*.py")]
"""Files outside the runtime that may use its constants (Python by ``trunnion.runtime.abi.header_constants.number``)."""


REPLACEMENT = NATIVE / "portable_compiler_settings.h"
"""Defines the names of ``base/compiler.h`` for exported sources, on purpose."""


def test_a_number_has_one_name_and_a_name_one_number() -> None:
    """All files of a translation unit share their names. If a constant had a second definition, its value would change within the
    unit."""
    files = [f for f in {*SOURCES, *(ENGINE / "kernel").rglob("*.hpp")} if f != REPLACEMENT]
    texts = [f.read_text(encoding="utf-8") for f in files]
    in_runtime = "".join(text for f, text in zip(files, texts, strict=True) if f.is_relative_to(RUNTIME))
    defined = Counter(re.findall(r"^#define ([A-Z_0-9]+) (?!_Pragma)", in_runtime, re.MULTILINE))
    numbers = Counter(name for text in texts for name in DEFINED.findall(text))
    assert [name for name, count in (*defined.items(), *numbers.items()) if count > 1] == []


def test_a_number_that_several_files_use_stands_among_the_tolerances() -> None:
    text = {name_of(f): code(f.read_text(encoding="utf-8")) for f in RUNTIME.rglob("*.[ch]")}
    words = {f: Counter(re.findall(r"\w+", here)) for f, here in text.items()}
    quoted, word = re.compile(r'"(?=(\w+)")'), re.compile(r"\w+")
    outside = {str(f): set((quoted if f.suffix == ".py" else word).findall(f.read_text(encoding="utf-8"))) for f in OTHERS}
    wrong = {}
    for file, here in text.items():
        for name in DEFINED.findall(here):
            users = {f for f, others in words.items() if others[name] > (f == file)}
            if file in SHARED:
                users |= {f for f, others in outside.items() if name in others}
                wrong |= {name: (file, users)} if len(users) < 2 and file == SHARED[0] else {}
            elif users - {file} and not file.endswith(".h"):
                wrong[name] = (file, users)
    assert wrong == {}


def test_thresholds_that_depend_on_each_other_are_in_order() -> None:
    """``engine/runtime/README.md`` explains the order. With another order, the runtime would report a mode that it has just decided
    as an event."""
    assert number("TOL_SPEED") < number("REST_SPEED") == number("TOL_RESOLVE") < number("TOL_RELEASE")
    assert number("REST_SPEED") < number("NEAR_MISS") < number("CAPTURE_SPEED")


def test_no_number_of_the_runtime_is_copied() -> None:
    """No file outside the shared ones defines a constant with the name of a shared constant. No comment says that a number is a
    copy."""
    shared = {name for file in SHARED for name in DEFINED.findall((RUNTIME / file).read_text(encoding="utf-8"))}
    copies = re.compile(r"^#define (\w+) +-?[\d.].*\bas (?:there|in ``|[A-Z]{3,})", re.MULTILINE)
    for file in [*RUNTIME.rglob("*.[ch]"), *OTHERS]:
        text = "" if file.suffix == ".py" else file.read_text(encoding="utf-8")
        assert copies.findall(text) == [], file
        assert name_of(file) in SHARED or not shared & set(DEFINED.findall(text)), file
