"""Exported sources build without a warning for machines of other kinds. They compute the same results on these machines."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.build import build_platform_binary

from tests.fmu.exported_fmus import arm
from tests.fmu.sources.c_library_build import DESIGNS, STRICT, Loaded, columns, foreign, printed, program, write, zig
from tests.fmu.sources.msvc_rules import refused
from trunnion.fmu.binaries.platform_builds import headers
from trunnion.fmu.c_library.library_files import Library, library
from trunnion.fmu.scene_export import export
from trunnion.scene import model_names, models_dir

pytestmark = pytest.mark.slow
EXAMPLE, UNTIL, EVERY = "spherical_pendulum", 10.0, 0.02
"""Example 8.1 of the paper, until it rests."""
SAME = 1e-12
"""Allowed difference relative to a column's size."""
MACHINES = {"x86_64-linux-musl": "", "aarch64-linux-musl": "qemu-aarch64", "arm-linux-musleabihf": "qemu-arm"}
"""Targets whose programs run here, and the program that runs them."""
CORTEX = ("--target=thumbv7em-none-eabihf", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-ffreestanding")
WASI = """const {readFileSync} = require("fs"), {WASI} = require("wasi");
const wasi = new WASI({version: "preview1", args: [], env: {}});
WebAssembly.instantiate(readFileSync(process.argv[2]), wasi.getImportObject()).then((m) => process.exit(wasi.start(m.instance)));
"""


@pytest.fixture(scope="module")
def made() -> Library:
    return library(EXAMPLE)


@pytest.fixture(scope="module")
def there(made: Library, tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """Rows of the example, printed by the program for this machine. Programs for other machines use the same C library."""
    return _rows(made, tmp_path_factory.mktemp("here"), "x86_64-linux-musl")


def _rows(made: Library, folder: Path, target: str) -> np.ndarray:
    files = [str(f) for f in program(folder, made, UNTIL, EVERY)]
    how = ["-target", target, *STRICT, "-O2", "-fno-sanitize=all", "-static"]
    assert zig([*how, *files, "-lm", "-o", str(folder / "program")]) == ""
    runner = MACHINES[target]
    words = [*([runner] if runner else []), str(folder / "program")]
    return printed(subprocess.run(words, capture_output=True, text=True, check=True).stdout)


def _same(made: Library, mine: np.ndarray, theirs: np.ndarray) -> None:
    assert mine.shape == theirs.shape
    assert mine.shape == (round(UNTIL / EVERY) + 1, len(columns(made)))
    size = np.maximum(1.0, np.abs(theirs).max(axis=0))
    assert (np.abs(mine - theirs) / size).max() <= SAME


@pytest.mark.parametrize("target", list(MACHINES)[1:])
def test_other_processors_compute_the_same_without_a_warning(target: str, made: Library, there: np.ndarray, tmp_path: Path) -> None:
    if not shutil.which(MACHINES[target]):
        pytest.skip(f"{MACHINES[target]} is not installed")
    _same(made, _rows(made, tmp_path, target), there)


def test_webassembly_computes_the_same_without_a_warning(made: Library, there: np.ndarray, tmp_path: Path) -> None:
    node = shutil.which("node")
    if not node:
        pytest.skip("node is not installed")
    files = [str(f) for f in program(tmp_path, made, UNTIL, EVERY)]
    how = ["-target", "wasm32-wasi", *STRICT, "-O2", "-fno-sanitize=all"]
    assert zig([*how, *files, "-lm", "-o", str(tmp_path / "program.wasm")]) == ""
    (tmp_path / "run.js").write_text(WASI)
    done = subprocess.run([node, "--no-warnings", str(tmp_path / "run.js"), str(tmp_path / "program.wasm")], capture_output=True,
                          text=True, check=True)  # fmt: skip
    _same(made, printed(done.stdout), there)


def test_the_compiler_of_a_controller_takes_the_library_without_a_warning(made: Library, tmp_path: Path) -> None:
    for file in write(tmp_path, made):
        assert foreign(CORTEX, ["-Os", "-c", str(file), "-o", str(tmp_path / "part.o")]) == "", file.name


@pytest.mark.parametrize("level", ["-O0", "-O2", "-O3"])
def test_gcc_takes_the_library_without_a_warning_at_every_level(level: str, made: Library, tmp_path: Path) -> None:
    if not shutil.which("gcc"):
        pytest.skip("gcc is not installed")
    for file in write(tmp_path, made):
        words = ["gcc", *STRICT, level, "-c", str(file), "-o", str(tmp_path / "part.o")]
        assert subprocess.run(words, capture_output=True, text=True, check=False).stderr == "", file.name


@pytest.mark.parametrize("name", [*model_names(), *DESIGNS, "arm"])
def test_every_model_runs_within_its_arrays_and_keeps_the_rules(name: str, tmp_path: Path) -> None:
    scene = arm() if name == "arm" else models_dir() / name
    made = library(scene, checked=True)
    loaded = Loaded(tmp_path, made)
    for file, text in library(scene).files.items():
        if file.endswith(".c") and file != "main.c":
            assert refused(text.replace("#define TR_RESTRICT restrict\n", "")) == [], file
    assert loaded.call("init") == 0
    assert loaded.call("start", 0.0) <= 1
    for _ in range(50):
        if loaded.call("step", made.step) > 1:
            break
    assert loaded.overruns == 0


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpy_and_the_cmake_file_of_an_fmu_build_it_from_its_sources_and_it_computes_the_same(fmi: int, tmp_path: Path) -> None:
    if not (shutil.which("cmake") and shutil.which("gcc")):
        pytest.skip("cmake and gcc are not installed")
    file, folder = tmp_path / "a.fmu", tmp_path / "unpacked"
    export(EXAMPLE, file, fmi=fmi, sources=True)
    how = {"stop_time": 2.0, "step_size": 0.02}
    shipped = fmpy.simulate_fmu(str(file), **how)
    fmpy.extract(str(file), str(folder))
    shutil.rmtree(folder / "binaries")
    build_platform_binary(folder, all_warnings=True)
    made = [fmpy.simulate_fmu(str(folder), **how)]
    (binary,) = (folder / "binaries").glob("*/*.so")
    binary.unlink()
    words = ["-S", str(folder / "sources"), "-B", str(tmp_path / "build"), f"-DFMI_HEADERS={headers()}"]
    for step in (words, ["--build", str(tmp_path / "build")]):
        subprocess.run(["cmake", *step], check=True, stdout=subprocess.DEVNULL)
    shutil.copyfile(tmp_path / "build" / binary.name, binary)
    made.append(fmpy.simulate_fmu(str(folder), **how))
    for name in shipped.dtype.names:
        for built in made:
            a, b = np.asarray(shipped[name], float), np.asarray(built[name], float)
            assert np.abs(a - b).max() <= SAME * max(1.0, np.abs(a).max()), name
