"""Functions for the tests of sources. They compile, load and run exported C."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from trunnion.fmu.c_library.library_files import Library
from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.scene import models_dir

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wvla")
DESIGNS = sorted(f"designer/{f.parent.name}" for f in models_dir().glob("designer/*/scene.yaml"))
"""Mechanisms of more bodies, some with friction in many joints, and an arm with inputs."""
BARE = Path(__file__).with_name("bare_metal_headers")
FITS = "-DTR_FITS(n,most)=((long)(n)>(long)(most)?(void)(trunnion_overruns++):(void)0)"
"""A macro that compares lengths with their bounds, and counts the lengths that exceed their bounds."""
MAIN = """#include <stdio.h>
#include "@.h"
static @ m;
int main(void) {
  int status = @_init(&m);
  if (status < 2) status = @_start(&m, 0.0);
  for (int i = 0; i <= STEPS && status < 2; ++i) {
    if (i) status = @_step(&m, EVERY);
    for (int k = 0; k < COLUMNS; ++k) printf("%a ", @_get(&m, k));
    printf("\\n");
  }
  return status;
}
"""
"""A program that prints every output at every step."""


def write(folder: Path, made: Library) -> list[Path]:
    """Write the files of a library into a folder. Returns its C files without the example."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in made.files.items():
        (folder / name).write_text(text)
    return [folder / f for f in sorted(made.files) if f.endswith(".c") and f != "main.c"]


def columns(made: Library) -> list[str]:
    """Names of the outputs of a library, in the order of their numbers."""
    return [v.name for v in made.called.values() if v.causality in ("output", "local")]


def zig(arguments: Sequence[str], what: str = "cc") -> str:
    """Messages of the compiler that comes with Trunnion; "" if the compiler accepts all files. The compiler uses the caches of the
    product."""
    shared = str(c_compiler.shared_cache(library_cache.cache_folder()))
    env = dict(os.environ, ZIG_GLOBAL_CACHE_DIR=shared, ZIG_LOCAL_CACHE_DIR=shared)
    done = subprocess.run([sys.executable, "-m", "ziglang", what, *arguments], capture_output=True, text=True, env=env, check=False)
    return done.stderr if done.returncode else ""


def foreign(target: Sequence[str], arguments: Sequence[str]) -> str:
    """Messages of clang when it compiles sources for a machine whose C library is not installed, without linking. "" if clang
    accepts all sources."""
    own = find_spec("ziglang")
    assert own is not None
    assert own.origin is not None
    headers = [f"-I{BARE}", f"-isystem{Path(own.origin).parent / 'lib' / 'include'}"]
    return zig([*target, "-nostdinc", *headers, *STRICT, *arguments], "clang")


class Loaded:
    """A library compiled for this machine, and one mechanism of it. The library counts arrays that need more than their bound."""

    def __init__(self, folder: Path, made: Library):
        sources = write(folder, made)
        (folder / "overruns.c").write_text("int trunnion_overruns;\n")
        target = folder / f"library{c_compiler.library_suffix()}"
        texts = [str(f) for f in [*sources, folder / "overruns.c"]]
        link = ["-shared", "-fPIC", "-nostdlib", "-lm", "-lc", "-o", str(target)]
        here = [*c_compiler.host().flags(), "-O0", "-fno-sanitize=all", "-include", str(_declared(folder)), FITS]
        self.complaints = zig([*STRICT, *here, *texts, *link])
        assert not self.complaints, self.complaints
        self.made, self.library = made, ctypes.CDLL(str(target))
        self.block = (ctypes.c_double * (made.bytes // 8))()

    def call(self, what: str, *numbers: float | int) -> float:
        """Call a function of the library on the mechanism."""
        function = getattr(self.library, f"{self.made.name}_{what}")
        function.restype = ctypes.c_double if what in ("get", "time") else ctypes.c_int
        given = [ctypes.c_double(n) if isinstance(n, float) else ctypes.c_int(n) for n in numbers]
        return function(ctypes.byref(self.block), *given)

    def row(self) -> np.ndarray:
        """The present values of all outputs."""
        return np.array([self.call("get", i) for i in range(len(columns(self.made)))])

    @property
    def overruns(self) -> int:
        """Number of arrays that have needed more than their bound so far."""
        return ctypes.c_int.in_dll(self.library, "trunnion_overruns").value


def _declared(folder: Path) -> Path:
    header = folder / "overruns.h"
    header.write_text("extern int trunnion_overruns;\n")
    return header


def program(folder: Path, made: Library, until: float, every: float) -> list[Path]:
    """The C files of a program that runs a mechanism and prints its outputs."""
    sources = write(folder, made)
    numbers = {"STEPS": str(round(until / every)), "EVERY": repr(every), "COLUMNS": str(len(columns(made)))}
    text = MAIN.replace("@", made.name)
    for word, number in numbers.items():
        text = text.replace(word, number)
    (folder / "main.c").write_text(text)
    return [*sources, folder / "main.c"]


def printed(text: str) -> np.ndarray:
    """The rows that a program of ``program`` printed."""
    return np.array([[float.fromhex(x) for x in line.split()] for line in text.splitlines()])
