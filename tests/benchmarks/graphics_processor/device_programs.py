"""Programs for a graphics processor, built on a machine without a graphics processor.

``python -m tests.benchmarks.graphics_processor.device_programs FOLDER`` compiles the C library of each mechanism to PTX. It also
writes the results of some cases that the same C code computes on this machine. The compiler that compiles the kernels also compiles
the runtime's unchanged C code for NVIDIA's processors. The script needs ``libdevice.10.bc`` (package ``nvidia-nvvm``, or a CUDA
toolkit). If ``ptxas`` is found, PTX is assembled, and the largest stack frame is reported. ``ensemble_run.py`` needs only the
folder, NumPy and the driver.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.speed.lane_batches import arm
from trunnion.fmu.c_library.library_files import Library, library
from trunnion.kernel.compilation.c_compiler import build_library
from trunnion.kernel.compilation.library_cache import cache_folder

HERE = Path(__file__).parent
ARCHITECTURE = "sm_90"
CHECKED = 200
"""Number of cases whose results are computed on this machine, too."""


@dataclass(frozen=True)
class Ensemble:
    """Cases of a mechanism. varied: range by variable. read: outputs. until: end of the runs, s."""

    scene: Any
    varied: dict[str, tuple[float, float]]
    read: tuple[str, ...]
    until: float


ENSEMBLES = {
    "8.1": Ensemble(
        "spherical_pendulum",
        {"joints.ball.friction.mu": (0.1, 0.6)},
        ("ball.friction.work", "pendulum.position[3]", "events.count"),
        5.0,
    ),
    "8.2 undriven": Ensemble(
        "crank_slider_free",
        {"joints.crank_pivot.start.qd[1]": (5.0, 15.0)},
        ("slider.position[1]", "energy.kinetic", "events.count"),
        10.0,
    ),
    "arm": Ensemble(
        arm(),
        {"joints.joint2.start.q[1]": (0.1, 0.5)},
        ("link6.position[1]", "energy.kinetic", "events.count"),
        2.0,
    ),
    "crank-slider": Ensemble(
        "crank_slider",
        {"joints.slider_pin.friction.mu": (0.05, 0.4)},
        ("slider_pin.friction.work", "slider.position[1]", "events.count"),
        2.0,
    ),
}  # fmt: skip


def libdevice() -> Path:
    """NVIDIA's mathematical functions as bitcode. FileNotFoundError if neither the package nor a toolkit is installed."""
    found = find_spec("nvidia")
    folders = list(found.submodule_search_locations or []) if found else []
    places = [p for f in folders for p in Path(f).glob("*/nvvm/libdevice/libdevice.10.bc")]
    places += [Path(os.environ.get("CUDA_HOME", "/usr/local/cuda"), "nvvm/libdevice/libdevice.10.bc")]
    for place in places:
        if place.is_file():
            return place
    raise FileNotFoundError("libdevice.10.bc was not found: install the package nvidia-nvvm, or set CUDA_HOME")


def c_sources(made: Library, folder: Path) -> list[Path]:
    """Write the library's C files and ``cases.c`` into a folder. Returns the paths of the files to compile."""
    for name, text in made.files.items():
        if name != "main.c" and name.endswith((".c", ".h")):
            (folder / name).write_text(text)
    shutil.copy(HERE / "cases.c", folder)
    return sorted(folder.glob("*.c"))


def names(made: Library) -> list[str]:
    """Compiler arguments that define the names in the library."""
    return [f"-DLIBRARY={made.name}", f'-DLIBRARY_HEADER="{made.name}.h"']


def ptx(made: Library, target: Path) -> list[Path]:
    """Compile a library to PTX, one file for each C file. Returns the paths of the files."""
    with tempfile.TemporaryDirectory() as work:
        sources = c_sources(made, Path(work))
        for standard in ("math.h", "string.h"):
            (Path(work) / standard).write_text("")  # all declarations are in device_functions.h
        headers = str(Path(find_spec("ziglang").origin).parent / "lib" / "include")
        common = [
            sys.executable, "-m", "ziglang", "clang", "--target=nvptx64-nvidia-cuda", f"-march={ARCHITECTURE}", "-x", "c", "-S",
            "-Os", "-std=gnu11", "-w", "-fno-builtin", "-ffp-contract=off", "-nostdinc", "-isystem", work, "-isystem", headers,
            "-include", str(HERE / "device_functions.h"), *names(made),
            "-Xclang", "-mlink-builtin-bitcode", "-Xclang", str(libdevice()),
        ]  # fmt: skip
        results = [target / f"{source.stem}.ptx" for source in sources]

        def compiled(source: Path, result: Path) -> None:
            subprocess.run([*common, str(source), "-o", str(result)], check=True)

        with ThreadPoolExecutor(2) as threads:
            list(threads.map(compiled, sources, results))
    return results


def largest_stack_frame(files: list[Path]) -> int | None:
    """Assemble PTX files. Returns the size of the largest stack frame, bytes; None without ``ptxas``."""
    assembler = shutil.which("ptxas")
    if assembler is None:
        return None
    frames = [0]
    for file in files:
        arguments = [assembler, "-v", "-c", f"-arch={ARCHITECTURE}", str(file), "-o", str(file.with_suffix(".cubin"))]
        told = subprocess.run(arguments, check=True, capture_output=True, text=True)
        frames += [int(n) for n in re.findall(r"(\d+) bytes stack frame", told.stdout + told.stderr)]
    return max(frames)


def on_this_machine(made: Library, ensemble: Ensemble, values: np.ndarray) -> np.ndarray:
    """Results of cases, (cases, 2 + outputs), computed by the same C code on this machine."""
    with tempfile.TemporaryDirectory() as work:
        shared = Path(work) / "cases.so"
        build_library(c_sources(made, Path(work)), shared, [Path(work)], cache_folder(), ["-ffp-contract=off", *names(made)])
        run = ctypes.CDLL(str(shared)).cases
        run.restype = None
        return filled(run, made, ensemble, values)


def filled(run: Any, made: Library, ensemble: Ensemble, values: np.ndarray) -> np.ndarray:
    """Call ``cases`` of a shared library."""
    variables, read = numbers(made, list(ensemble.varied)), numbers(made, list(ensemble.read))
    values = np.ascontiguousarray(values, dtype=float)
    out, struct = np.zeros((len(values), 2 + len(read))), np.zeros(made.bytes, dtype=np.uint8)
    pointers = [a.ctypes.data_as(ctypes.c_void_p) for a in (variables, values, read, out, struct)]
    run(
        ctypes.c_long(len(values)), ctypes.c_int(len(variables)), pointers[0], pointers[1], ctypes.c_int(len(read)), pointers[2],
        pointers[3], pointers[4], ctypes.c_double(ensemble.until),
    )  # fmt: skip
    return out


def numbers(made: Library, wanted: list[str]) -> np.ndarray:
    """Numbers of variables in the library, by name."""
    order = [variable.name for variable in made.called.values()]
    return np.array([order.index(name) for name in wanted], dtype=np.int32)


def drawn(ensemble: Ensemble, count: int, seed: int) -> np.ndarray:
    """Random values of the varied variables: (count, variables)."""
    low, high = np.array(list(ensemble.varied.values())).T
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def write(folder: Path, which: str) -> dict[str, Any]:
    """Build the programs of an ensemble in a folder. The folder also gets the results of the first cases from an ordinary
    processor."""
    ensemble = ENSEMBLES[which]
    made = library(ensemble.scene)
    folder.mkdir(parents=True, exist_ok=True)
    files = ptx(made, folder)
    frame = largest_stack_frame(files)
    low, high = np.array(list(ensemble.varied.values())).T
    facts = {
        "name": which, "bytes": made.bytes, "until": ensemble.until, "low": low.tolist(), "high": high.tolist(), "frame": frame,
        "set": numbers(made, list(ensemble.varied)).tolist(), "read": numbers(made, list(ensemble.read)).tolist(),
    }  # fmt: skip
    (folder / "facts.json").write_text(json.dumps(facts))
    values = drawn(ensemble, CHECKED, 1)
    np.savez(folder / "expected.npz", values=values, out=on_this_machine(made, ensemble, values))
    return facts | {"kB": sum(f.stat().st_size for f in files) // 1000}


def main() -> None:
    """Write the folder, and print the names of the built programs."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("folder", type=Path)
    ask.add_argument("--only", default="")
    asked = ask.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(HERE / "ensemble_run.py", asked.folder)
    for which in ENSEMBLES:
        if asked.only in which:
            told = write(asked.folder / re.sub(r"\W+", "_", which), which)
            sizes = f"{told['kB']} kB of PTX, {told['bytes']} bytes a case, largest stack frame {told['frame']} bytes"
            print(f"{which}: {sizes}", flush=True)


if __name__ == "__main__":
    main()
