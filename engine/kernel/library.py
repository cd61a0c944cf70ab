"""Compiled kernels and the runtime as ctypes libraries, from the cache or built on the spot.

The key of a kernel is the structure of its system, the columns asked for, the sources of everything that shapes the code, the
compiler and the CPU level; so a warm start needs neither the symbolic library nor the compiler. What is compiled is kept by its
text besides: scenes that differ in names or columns share what they have in common.
"""

from __future__ import annotations

import ctypes
import json
import logging
import shutil
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from engine.abi.header import header
from engine.abi.kernels import KERNEL
from engine.basics.interrupts import heed, held
from engine.kernel import built, cache, compiler
from engine.kernel.columns import Column
from engine.kernel.programs import awaited, side_by_side
from engine.system.structure import System

log = logging.getLogger("trunnion.kernel")
ENGINE = Path(__file__).resolve().parent.parent
RUNTIME = ENGINE / "runtime"
SHAPING = ("abi", "contact", "friction", "integrators", "joints", "kernel", "recursion", "system")
UNITS = {"kernel": "trunnion_kernel", "outputs": "trunnion_outputs", "jacobian": "trunnion_jacobian", "linear": "trunnion_linear",
         "lanes": "trunnion_lanes"}


@lru_cache(maxsize=1)
def sources_key() -> str:
    """Digest of all Python sources that shape generated code."""
    files = sorted(f for folder in SHAPING for f in (ENGINE / folder).glob("*.py"))
    return cache.digest(*(f.read_bytes() for f in files))


@lru_cache(maxsize=1)
def runtime_key() -> str:
    """Digest of the runtime's C sources and of what the headers they include are generated from."""
    files = sorted([*RUNTIME.glob("*.[ch]"), *(f for folder in ("abi", "integrators") for f in (ENGINE / folder).glob("*.py"))])
    return cache.digest(*(f.read_bytes() for f in files), *_toolchain())


@lru_cache(maxsize=1)
def _toolchain() -> tuple[str, ...]:
    flags = " ".join(compiler.FLAGS) + str(compiler.STRAIGHT) + str(compiler.LONG_TEXT)
    return (compiler.compiler_version(), compiler.host_target(), compiler.cpu_level(), flags, compiler.version_of("casadi"))


def kernel_key(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> str:
    """Key of a system's kernel in the cache: a digest of all that shapes its code."""
    names = ",".join(c.name for c in chosen)
    how = f"{quadratures} {redundant} {compiler.quick()}"
    return cache.digest(repr(system), str(parameters), names, how, sources_key(), *_toolchain())


@lru_cache(maxsize=1)
def runtime() -> ctypes.CDLL:
    """The stepping code: the installation's, else compiled once a machine."""
    found = built.library("runtime")
    if found:
        return found
    return ctypes.CDLL(str(compiled_runtime()))


def compiled_runtime() -> Path:
    """The runtime's library, compiled once a machine."""
    folder, made = cache.entry(f"runtime-{runtime_key()}", _build_runtime)
    log.debug("runtime %s from %s", "built" if made else "found", folder)
    return folder / f"runtime{compiler.library_suffix()}"


def _build_runtime(folder: Path) -> None:
    write_headers(folder)
    target = folder / f"runtime{compiler.library_suffix()}"
    compiler.build_library([RUNTIME / "api.c"], target, [RUNTIME, folder], cache.cache_folder())


def write_headers(folder: Path) -> None:
    """The generated headers of the runtime: what it shares with Python, and the integrators' code."""
    from engine.integrators.header import header as tables

    (folder / "tr_abi.h").write_text(header())
    (folder / "tr_tables.h").write_text(tables())


@dataclass
class Kernel:
    """A loaded kernel: addresses of its tables, its sizes, and what building it took (seconds, 0 when it was there)."""

    libraries: dict[str, ctypes.CDLL]
    sizes: dict[str, int]
    facts: dict[str, Any]
    build_seconds: float
    folder: Path
    key: str
    structure: tuple[System, int, bool, bool]

    def jacobian(self) -> int:
        """Address of the Jacobian unit's table, built when it is first asked for."""
        if "jacobian" not in self.libraries:
            self.libraries["jacobian"] = jacobian_library(self.key, self.structure)
        return self.address("jacobian")

    def lanes(self) -> int:
        """Address of the table of its lanes, built when they are first asked for (``lanes_unit.stands_for``)."""
        if "lanes" not in self.libraries:
            self.libraries["lanes"] = lanes_library(self)
        return self.address("lanes")

    def lane_columns(self) -> int:
        """Address of the function that makes the columns of several rows at once; 0: there is none."""
        if "columns" not in self.libraries and (made := columns_library(self)):
            self.libraries["columns"] = made
        there = self.libraries.get("columns")
        return ctypes.cast(there.l_columns, ctypes.c_void_p).value or 0 if there else 0

    def linear(self, chosen: list[Column]) -> int:
        """Address of the table of the linear unit for these columns, built when it is first asked for."""
        return linear_unit(self, chosen)

    def address(self, unit: str) -> int:
        """Address of a unit's table."""
        return ctypes.addressof(ctypes.c_int.in_dll(self.libraries[unit], UNITS[unit]))


def lanes_library(built: Kernel) -> ctypes.CDLL:
    """The lanes of a compiled kernel."""
    from engine.kernel.lanes_unit import lanes_text

    return _vectors("lanes", lanes_text((built.folder / "kernel.c").read_text(), built.sizes))


def columns_library(built: Kernel) -> ctypes.CDLL | None:
    """The columns of its rows, several at once (``lanes_unit.sizes_of_columns``)."""
    from engine.kernel.lanes_unit import columns_text, sizes_of_columns

    sizes = sizes_of_columns(built)
    return _vectors("columns", columns_text((built.folder / "outputs.c").read_text(), sizes)) if sizes else None


def _vectors(unit: str, text: str) -> ctypes.CDLL:
    """The library of C++ text that computes in vectors."""
    from engine.kernel.lanes_unit import FLAGS

    flags = FLAGS + (compiler.AS_WRITTEN if unit == "columns" else ())

    def make(place: Path) -> None:
        compiler.needed("this batch", "the lanes of its scene")
        (place / f"{unit}.cpp").write_text(text)
        (place / "tr_abi.h").write_text(header())
        target = place / f"{unit}{compiler.library_suffix()}"
        compiler.build_library([place / f"{unit}.cpp"], target, [place], cache.cache_folder(), flags)

    folder, _ = cache.entry(f"{unit}-{cache.digest(text, header(), *flags, *_toolchain())}", make)
    return ctypes.CDLL(str(folder / f"{unit}{compiler.library_suffix()}"))


def jacobian_library(key: str, structure: tuple[System, int, bool, bool]) -> ctypes.CDLL:
    """The Jacobian unit of the kernel with this key."""

    folder, _ = cache.entry(f"jacobian-{key}", lambda place: build_jacobian(place, structure))
    return ctypes.CDLL(str(folder / f"jacobian{compiler.library_suffix()}"))


def build_jacobian(folder: Path, structure: tuple[System, int, bool, bool]) -> None:
    """Build the Jacobian unit of a structure into the folder of a cache entry."""
    compiler.needed("this run", "the Jacobian of its scene")
    from engine.kernel.source import jacobian_source

    system, parameters, _, redundant = structure
    _compile_unit(folder, "jacobian", jacobian_source(system, parameters, redundant))


def linear_unit(built: Kernel, chosen: list[Column]) -> int:
    """Address of the table of a kernel's linear unit for these columns, built when it is first asked for."""
    if "linear" not in built.libraries:

        def make(folder: Path) -> None:
            compiler.needed("this linearization", "the derivatives of its scene")
            from engine.kernel.source import linear_source

            system, parameters, quadratures, redundant = built.structure
            _compile_unit(folder, "linear", linear_source(system, parameters, chosen, quadratures, redundant))

        folder, _ = cache.entry(f"linear-{cache.digest(built.key, *(c.name for c in chosen))}", make)
        built.libraries["linear"] = ctypes.CDLL(str(folder / f"linear{compiler.library_suffix()}"))
    return built.address("linear")


def kernel(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool = False) -> Kernel:
    """The kernel of a system with these columns. Builds the runtime beside it when that is missing too."""
    started = time.perf_counter()
    key = kernel_key(system, parameters, chosen, quadratures, redundant)

    def make(folder: Path) -> None:
        _build_kernel(folder, system, parameters, chosen, quadratures, redundant)

    with held() as interrupt, interrupt.open(), side_by_side(1) as submit:
        waiting = submit(runtime)
        folder, made = cache.entry(f"kernel-{key}", make)
        awaited(waiting)
    libraries = {u: ctypes.CDLL(str(folder / f"{u}{compiler.library_suffix()}")) for u in ("kernel", "outputs")}
    table = KERNEL.ctype.in_dll(libraries["kernel"], UNITS["kernel"])
    sizes = {n: int(getattr(table, n)) for n in KERNEL.integers} | {"works": int(table.npowers) * quadratures}
    facts = json.loads((folder / "facts.json").read_text())
    return Kernel(libraries, sizes, facts, time.perf_counter() - started if made else 0.0, folder, key,
                  (system, parameters, quadratures, redundant))


def _build_kernel(folder: Path, system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> None:
    compiler.needed("this run", "the kernel of its scene", "; or --kernel parts, on which nothing is compiled")
    from engine.kernel.source import kernel_source

    started = time.perf_counter()
    source = kernel_source(system, parameters, chosen, quadratures, redundant)
    symbolic = time.perf_counter() - started
    heed()
    with side_by_side(2) as submit:
        for job in [submit(_compile_unit, folder, unit, text) for unit, text in source.units.items()]:
            awaited(job)
    facts = dict(source.facts, symbolic_seconds=symbolic, compile_seconds=time.perf_counter() - started - symbolic)
    (folder / "facts.json").write_text(json.dumps(facts))


def _compile_unit(folder: Path, unit: str, text: str) -> None:
    """The library of a unit, beside its text. It is looked for by its text first: other columns leave the stepping unit as it was,
    and other names change neither."""
    library, flags = f"{unit}{compiler.library_suffix()}", compiler.unit_flags(unit, text)

    def make(place: Path) -> None:
        (place / f"{unit}.c").write_text(text)
        (place / "tr_abi.h").write_text(header())
        compiler.build_library([place / f"{unit}.c"], place / library, [place], cache.cache_folder(), flags)

    (folder / f"{unit}.c").write_text(text)
    found, _ = cache.entry(f"unit-{cache.digest(unit, text, header(), *flags, *_toolchain())}", make)
    shutil.copyfile(found / library, folder / library)
