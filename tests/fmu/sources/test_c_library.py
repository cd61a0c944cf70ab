"""Exported sources are C99 that any compiler accepts, and compute the engine's results."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.model_description import read_build_description

from tests.fmu.fmpy_validation import validated
from tests.fmu.native.test_floating_point_environments import HERE, PLAIN, UNUSUAL, bits_in
from tests.fmu.sources.c_library_build import STRICT, Loaded, columns, foreign, write
from tests.fmu.sources.msvc_rules import refused
from trunnion.basics.errors import SceneError
from trunnion.cli import main
from trunnion.fmu.c_library.library_files import Library, library, library_name
from trunnion.fmu.c_text.constant_length_arrays import BoundMissing, fixed
from trunnion.fmu.c_text.dead_code_and_ascii import definitions, used_only
from trunnion.fmu.scene_export import export

SCENE, UNTIL, EVERY = "spherical_pendulum", 0.5, 0.05
HEADERS = Path(str(fmpy.__file__)).parent / "c-code"
SAME = 1e-12
"""Allowed difference relative to a column's size. The FMU is for a baseline that cannot fuse products, so that both results are the
same up to round-off."""
HEAP = ("malloc", "calloc", "realloc", "free", "printf", "snprintf", "vsnprintf", "fopen", "puts", "exit", "abort", "time")


@pytest.fixture(scope="module")
def made() -> Library:
    return library(SCENE)


@pytest.fixture(scope="module")
def loaded(made: Library, tmp_path_factory: pytest.TempPathFactory) -> Loaded:
    return Loaded(tmp_path_factory.mktemp("library"), library(SCENE, checked=True))


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU without sources."""
    file = tmp_path_factory.mktemp("fmu") / "plain.fmu"
    export(SCENE, file)
    return file


def test_a_library_compiled_without_a_warning_steps_as_the_fmu_does_within_its_arrays(loaded: Loaded, plain: Path) -> None:
    names, rows = columns(loaded.made), []
    assert loaded.call("init") == 0
    assert math.isnan(loaded.call("get", len(loaded.made.called)))
    assert loaded.call("start", 0.0) == 0
    rows.append(loaded.row())
    for _ in range(round(UNTIL / EVERY)):
        assert loaded.call("step", EVERY) == 0
        rows.append(loaded.row())
    assert loaded.call("time") == pytest.approx(UNTIL, rel=1e-12)
    theirs = fmpy.simulate_fmu(str(plain), stop_time=UNTIL, step_size=EVERY, output_interval=EVERY, output=names)
    for name, mine in zip(names, np.array(rows).T, strict=True):
        other = np.asarray(theirs[name], float)
        assert np.abs(mine - other).max() <= SAME * max(1.0, np.abs(other).max()), name
    assert loaded.overruns == 0


@HERE
def test_a_program_that_traps_exceptions_and_rounds_upward_gets_the_same_bits(loaded: Loaded) -> None:
    run = {"form": loaded.made.name, "library": loaded.library._name, "token": "", "resources": "", "states": 0, "indicators": 0}
    run |= {"references": list(range(len(columns(loaded.made)))), "values": len(columns(loaded.made))}
    assert bits_in(run, UNUSUAL) == bits_in(run, PLAIN)


@pytest.mark.slow
def test_a_parameter_counts_and_a_copy_of_the_struct_continues_alone(loaded: Loaded) -> None:
    called = list(loaded.made.called.values())
    mu = next(i for i, v in enumerate(called) if v.name.endswith("friction.mu"))
    angle = next(i for i, v in enumerate(called) if v.name.endswith(".qd[1]"))
    assert loaded.call("init") == 0
    assert loaded.call("set", mu, -1.0) == 2  # the value is refused
    assert loaded.call("set", mu, 0.3) == 0
    assert loaded.call("step", EVERY) == 3  # a step before the start is refused
    assert loaded.call("start", 0.0) == 0
    kept = bytes(loaded.block)
    assert loaded.call("step", EVERY) == 0
    first = loaded.call("get", angle)
    loaded.block[:] = type(loaded.block).from_buffer_copy(kept)[:]
    assert loaded.call("step", EVERY) == 0
    assert loaded.call("get", angle) == first


def test_gcc_takes_the_sources_without_a_warning(made: Library, tmp_path: Path) -> None:
    if not shutil.which("gcc"):
        pytest.skip("gcc is not installed")
    files = [str(f) for f in write(tmp_path, made)]
    done = subprocess.run(["gcc", *STRICT, "-fsyntax-only", *files], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_sources_keep_microsofts_rules_and_need_neither_heap_nor_files(made: Library, tmp_path: Path) -> None:
    for name, text in made.files.items():
        if not name.endswith((".c", ".h")) or name == "main.c":
            continue
        assert refused(text.replace("#define TR_RESTRICT restrict\n", "")) == [], name
        assert not set(re.findall(r"\b\w+(?=\()", re.sub(r'"[^"\n]*"|/\*.*?\*/', "", text, flags=re.DOTALL))) & set(HEAP), name
        assert not re.search(r"stdio|stdlib|stdint", text), name
    write(tmp_path, made)
    for file in sorted(f for f in made.files if f.endswith(".c") and f != "main.c"):
        target = ["--target=x86_64-pc-windows-msvc", "-fms-compatibility", "-fms-compatibility-version=19.20", "-ffreestanding"]
        assert not foreign(target, ["-fsyntax-only", str(tmp_path / file)]), file


@pytest.mark.parametrize("text", [
    "int f(int n) {\n  double x[n];\n}", "int a = b ?: c;", "int a = ({ 1; });", "double x[0];", "int i = __builtin_ctz(3);",
    "struct s t = {};", "double y = M_PI;", "/* ü */", "switch (a) { case 1 ... 3: b(); }", f'char *s = "{"a" * 20_000}";',
])  # fmt: skip
def test_extensions_that_microsofts_compiler_lacks_are_refused(text: str) -> None:
    assert refused(text)


def test_external_names_begin_with_the_models_name(made: Library) -> None:
    for name, text in made.files.items():
        if name.endswith(".c") and name != "main.c":
            seen = [d.name for d in definitions(text) if not d.static] + re.findall(r"^const \w+ (\w+)=", text, re.MULTILINE)
            assert seen, name
            assert all(n.startswith(f"{SCENE}_") for n in seen), name


def test_nothing_exported_names_this_machine(made: Library) -> None:
    here = {str(p) for p in (Path.cwd(), Path.home(), Path(tempfile.gettempdir()), Path(__file__).parents[3], Path(sys.prefix))}
    for name, text in made.files.items():
        assert not [p for p in here if f"{p}/" in text], name


def test_an_array_of_which_nobody_says_how_long_it_becomes_is_refused() -> None:
    text = "static int f(int n) {\n  double x[n];\n  return n;\n}\n"
    with pytest.raises(BoundMissing, match=r"f: n of \[n\]"):
        fixed(text)
    known = "static int f(const tr_kernel *k) {\n  const int n = k->neta + 1;\n  double x[n], y[3];\n  g(sizeof x);\n}\n"
    assert "x[TR_ROOM((TR_MAX_NETA + 1))], y[3]" in fixed(known)
    assert "g((sizeof x[0] * (size_t)(n)))" in fixed(known)


def test_functions_without_a_caller_are_left_out() -> None:
    used = "static void g(void);\nint f(void) { return 1; }\nstatic int h(void) { return g(); }\nstatic void g(void) {\n}\n"
    assert used_only(used) == "int f(void) { return 1; }\n"


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_names_its_sources(fmi: int, plain: Path, tmp_path: Path) -> None:
    file = tmp_path / "with.fmu"
    export(SCENE, file, fmi=fmi, sources=True)
    assert validated(str(file)) == []
    with zipfile.ZipFile(file) as z, zipfile.ZipFile(plain) as other:
        there = {n.removeprefix("sources/") for n in z.namelist() if n.startswith("sources/") and n.endswith(".c")}
        assert not any(n.startswith("sources/") for n in other.namelist())
        library_of = [n for n in z.namelist() if n.startswith("binaries/")]
        assert fmi == 3 or all(z.read(n) == other.read(n) for n in library_of)  # the libraries of both FMUs have the same bytes
        texts = {n: z.read(f"sources/{n}").decode() for n in there}
        root = ElementTree.fromstring(z.read("modelDescription.xml"))
        z.extractall(tmp_path / "x")
    assert all(refused(t.replace("#define TR_RESTRICT restrict\n", "")) == [] for t in texts.values())
    if fmi == 2:
        assert {e.get("name") for e in root.findall("CoSimulation/SourceFiles/File")} == there
    else:
        told = read_build_description(str(tmp_path / "x"))
        assert set(told[0].sourceFileSets[0].sourceFiles) == there
    if shutil.which("gcc"):
        files = [str(tmp_path / "x" / "sources" / n) for n in sorted(there) if "runtime" not in n]
        words = ["gcc", *STRICT, "-fsyntax-only", f"-I{HEADERS}", *files]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_exports_without_sources_are_refused_with_the_option_to_use(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="--flavour native"):
        export(SCENE, tmp_path / "a.fmu", flavour="python", sources=True)
    with pytest.raises(SceneError, match="--kernel compiled"):
        export(SCENE, tmp_path / "a.fmu", kernel="parts", sources=True)


def test_the_command_writes_a_folder_and_says_how_it_is_built(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "c", SCENE, "-o", str(tmp_path / "out"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert sorted(f.name for f in (tmp_path / "out").iterdir()) == said["files"]
    assert {"main.c", "CMakeLists.txt", "README.md", f"{SCENE}.h"} < set(said["files"])
    assert len((tmp_path / "out" / "main.c").read_text().splitlines()) < 20
    (tmp_path / "file").write_text("")
    assert main(["export", "c", SCENE, "-o", str(tmp_path / "file")]) == 2
    assert "is a file" in capsys.readouterr().err
    assert [library_name(n) for n in ("Double", "string", "door")] == ["m_double", "m_string", "door"]
