"""Compiled kernels and the runtime as ctypes libraries, from the cache or built on demand.

The key of a kernel depends on the system's structure, the columns, all sources that influence code, the compiler and the CPU level.
A start with a filled cache therefore needs neither the symbolic library nor the compiler. The C files of a kernel (units) are also
cached by their text. Scenes that differ only in names or columns therefore share units. """

from __future__ import annotations

import ctypes
import json
import logging
import shutil
import time
from collections.abc import Callable
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from trunnion.basics.interrupts import heed, held
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.kernel.compilation import prebuilt_libraries as built
from trunnion.kernel.compilation.compiler_processes import awaited, side_by_side
from trunnion.kernel.interface.output_columns import Column
from trunnion.runtime.abi.c_header import header
from trunnion.runtime.abi.entry_points import entry_points
from trunnion.runtime.abi.kernel_records import KERNEL, OUTPUTS
from trunnion.runtime.abi.run_records import EXTRA
from trunnion.system.structure.bodies_and_joints import System

log = logging.getLogger("trunnion.kernel")
ENGINE = Path(__file__).resolve().parent.parent
RUNTIME = ENGINE / "runtime"
SHAPING = ("columns", "elements", "kernel", "recursion", "runtime", "system")
GUARDED = "host_"
"""Prefix of the runtime's functions that Python calls. Each function sets the floating-point environment at its start, and restores
the environment of Python at its end."""
UNITS = {"kernel": "trunnion_kernel", "outputs": "trunnion_outputs", "jacobian": "trunnion_jacobian", "linear": "trunnion_linear",
         "lanes": "trunnion_lanes"}
MOST_FRICTIONS = 12
"""Largest number of friction multipliers with which cases step in lanes. With more multipliers, lanes would need large maps."""
MOST_TEXT, MOST_MAPS = 60_000, 1_000
"""Largest sizes with which lanes compute rows. MOST_TEXT: characters of the output unit's text. MOST_MAPS: doubles in the maps. The
output unit is compiled a second time for lanes, and each case has the data of rows on its stack."""


@lru_cache(maxsize=1)
def sources_key() -> str:
    """Digest of all Python sources that influence generated code."""
    return library_cache.digest_of_files(ENGINE, SHAPING, (".py",))


@lru_cache(maxsize=1)
def runtime_key(machine: c_compiler.Machine | None = None) -> str:
    """Digest of the runtime's C sources, of the Python sources that generate its headers, and of the compiler for a machine."""
    sources = library_cache.digest_of_files(ENGINE, ["runtime"], (".c", ".h", ".py"))
    return library_cache.digest(sources, *c_compiler.toolchain(machine))


@lru_cache(maxsize=1)
def _toolchain() -> tuple[str, ...]:
    return (*c_compiler.toolchain(), str(c_compiler.STRAIGHT), str(c_compiler.LONG_TEXT), c_compiler.version_of("casadi"))


def kernel_key(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> str:
    """Key of a system's kernel in the cache: a digest of everything that influences its code."""
    names = ",".join(c.name for c in chosen)
    how = f"{quadratures} {redundant} {c_compiler.quick()}"
    return library_cache.digest(repr(system), str(parameters), names, how, sources_key(), *_toolchain())


@lru_cache(maxsize=1)
def runtime() -> ctypes.CDLL:
    """The compiled runtime. If the installation has no compiled runtime, this machine compiles it once."""
    return built.library("runtime") or ctypes.CDLL(str(compiled_runtime()))


def compiled_runtime(machine: c_compiler.Machine | None = None) -> Path:
    """Path of the runtime's library for a machine, by default this machine. The library is compiled once."""
    name = f"runtime{machine.suffix if machine else c_compiler.library_suffix()}"

    def make(folder: Path) -> None:
        write_headers(folder)
        sources = [RUNTIME / "runtime.c", written_entries(folder)]
        c_compiler.build_library(sources, folder / name, [RUNTIME, folder], library_cache.cache_folder(), machine=machine)

    folder, made = library_cache.entry(f"runtime-{runtime_key(machine)}", make)
    log.debug("runtime %s from %s", "built" if made else "found", folder)
    return folder / name


def written_entries(folder: Path) -> Path:
    """Write, into a folder, a C file with the functions that Python calls. Returns the path of the file."""
    file = folder / "entry_points.c"
    file.write_text(entry_points("hosts/hosts.h", (RUNTIME / "hosts" / "hosts.h").read_text(), host=GUARDED))
    return file


def write_headers(folder: Path) -> None:
    """Write the generated headers of the runtime: the ABI and the tables of methods."""
    from trunnion.runtime.integrators.method_c_code import header as tables

    (folder / "tr_abi.h").write_text(header())
    (folder / "tr_tables.h").write_text(tables())


@dataclass
class Kernel:
    """A loaded kernel, with its libraries, sizes, facts, build time (s; 0 from the cache), the folder of its cache entry, and its
    columns."""

    libraries: dict[str, ctypes.CDLL]
    sizes: dict[str, int]
    facts: dict[str, Any]
    build_seconds: float
    folder: Path
    columns: list[Column]
    structure: tuple[System, int, bool, bool]

    @cached_property
    def key(self) -> str:
        """Key of the kernel in the cache. Most runs by parts never read the key, and it takes longer than their steps."""
        system, parameters, quadratures, redundant = self.structure
        return kernel_key(system, parameters, self.columns, quadratures, redundant)

    def jacobian(self) -> int:
        """Address of the Jacobian unit's table. The first call builds the unit."""
        if "jacobian" not in self.libraries:
            self.libraries["jacobian"] = _cached("jacobian", self.key, lambda place: build_jacobian(place, self.structure))
        return self.address("jacobian")

    def lanes(self) -> int:
        """Address of the table of functions that step cases in SIMD lanes. The first call builds these functions. Requires
        ``lanes_fit``."""
        if "lanes" not in self.libraries:
            from trunnion.kernel.units.simd_lanes_unit import lanes_text

            self.libraries["lanes"] = _vectors("lanes", lanes_text((self.folder / "kernel.c").read_text(), self.sizes))
        return self.address("lanes")

    def lane_columns(self) -> int:
        """Address of the function that computes the columns of rows in lanes; 0 if there is no such function."""
        if "columns" not in self.libraries and (made := columns_library(self)):
            self.libraries["columns"] = made
        there = self.libraries.get("columns")
        return ctypes.cast(there.l_columns, ctypes.c_void_p).value or 0 if there else 0

    def linear(self, chosen: list[Column]) -> int:
        """Address of the linear unit's table for these columns. The first call builds the unit."""
        if "linear" not in self.libraries:
            key = library_cache.digest(self.key, *(c.name for c in chosen))
            self.libraries["linear"] = _cached("linear", key, lambda place: _build_linear(place, self.structure, chosen))
        return self.address("linear")

    def address(self, unit: str) -> int:
        """Address of a unit's table."""
        return ctypes.addressof(ctypes.c_int.in_dll(self.libraries[unit], UNITS[unit]))


def _cached(unit: str, key: str, make: Callable[[Path], None]) -> ctypes.CDLL:
    """The library of a unit, from the cache. If the library is missing, ``make(folder)`` builds it."""
    folder, _ = library_cache.entry(f"{unit}-{key}", make)
    return ctypes.CDLL(str(folder / f"{unit}{c_compiler.library_suffix()}"))


def columns_library(built: Kernel) -> ctypes.CDLL | None:
    """Library that computes the columns of rows in lanes, or None if rows are computed one by one."""
    table = OUTPUTS.ctype.from_address(built.address("outputs"))
    text = built.folder / "outputs.c"
    if not table.nout or built.sizes["nmaps"] > MOST_MAPS or not text.exists() or text.stat().st_size > MOST_TEXT:
        return None
    from trunnion.kernel.units.simd_lanes_unit import columns_text

    sizes = {"nco": table.nc, "nout": table.nout, "nextra": EXTRA.numbers + built.sizes["nsliders"]}
    return _vectors("columns", columns_text(text.read_text(), sizes))


def lanes_fit(kernel: Kernel) -> bool:
    """Whether the cases of a kernel can step in SIMD lanes. This requires compiled code, few friction multipliers, no tables and
    few loops."""
    table = KERNEL.ctype.from_address(kernel.address("kernel"))
    compiled = (kernel.folder / "kernel.c").exists() and table.neta <= MOST_FRICTIONS
    return compiled and not any(getattr(table, n) for n in ("ntables", "nfill", "nkappa", "begin", "shift"))


def _vectors(unit: str, text: str) -> ctypes.CDLL:
    """Library of a C++ text that computes in SIMD vectors."""
    from trunnion.kernel.units.simd_lanes_unit import FLAGS

    flags = FLAGS + (c_compiler.AS_WRITTEN if unit == "columns" else ())

    def make(place: Path) -> None:
        c_compiler.needed("this batch", "the lanes of its scene")
        _compile(place / f"{unit}.cpp", text, flags)

    return _cached(unit, library_cache.digest(text, header(), *flags, *_toolchain()), make)


def _compile(source: Path, text: str, flags: tuple[str, ...]) -> None:
    """Write a unit's text to a file. Compile it to a library of the same name, in the same folder."""
    source.write_text(text)
    (source.parent / "tr_abi.h").write_text(header())
    library = source.with_suffix(c_compiler.library_suffix())
    c_compiler.build_library([source], library, [source.parent], library_cache.cache_folder(), flags)


def build_jacobian(folder: Path, structure: tuple[System, int, bool, bool]) -> None:
    """Build the Jacobian unit of a structure into the folder of a cache entry."""
    c_compiler.needed("this run", "the Jacobian of its scene")
    from trunnion.kernel.c_sources import jacobian_source

    system, parameters, _, redundant = structure
    _compile_unit(folder, "jacobian", jacobian_source(system, parameters, redundant))


def _build_linear(folder: Path, structure: tuple[System, int, bool, bool], chosen: list[Column]) -> None:
    c_compiler.needed("this linearization", "the derivatives of its scene")
    from trunnion.kernel.c_sources import linear_source

    system, parameters, quadratures, redundant = structure
    _compile_unit(folder, "linear", linear_source(system, parameters, chosen, quadratures, redundant))


def kernel(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool = False) -> Kernel:
    """The kernel of a system with these columns. Builds the runtime, too, if it is missing."""
    started = time.perf_counter()
    key = kernel_key(system, parameters, chosen, quadratures, redundant)

    def make(folder: Path) -> None:
        _build_kernel(folder, system, parameters, chosen, quadratures, redundant)

    with held() as interrupt, interrupt.open(), side_by_side(1) as submit:
        waiting = submit(runtime)
        folder, made = library_cache.entry(f"kernel-{key}", make)
        awaited(waiting)
    libraries = {u: ctypes.CDLL(str(folder / f"{u}{c_compiler.library_suffix()}")) for u in ("kernel", "outputs")}
    table = KERNEL.ctype.in_dll(libraries["kernel"], UNITS["kernel"])
    sizes = {n: int(getattr(table, n)) for n in KERNEL.integers} | {"works": int(table.npowers) * quadratures}
    facts = json.loads((folder / "facts.json").read_text())
    return Kernel(libraries, sizes, facts, time.perf_counter() - started if made else 0.0, folder, chosen,
                  (system, parameters, quadratures, redundant))


def _build_kernel(folder: Path, system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> None:
    c_compiler.needed("this run", "the kernel of its scene", "; or use --kernel parts, which compiles nothing")
    from trunnion.kernel.c_sources import kernel_source

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
    """Write a unit's text and library into a folder. The text is the key of the cache. Therefore other columns do not rebuild the
    stepping unit, and other names rebuild no unit."""
    library, flags = f"{unit}{c_compiler.library_suffix()}", c_compiler.unit_flags(unit, text)

    name = f"unit-{library_cache.digest(unit, text, header(), *flags, *_toolchain())}"
    (folder / f"{unit}.c").write_text(text)
    found, _ = library_cache.entry(name, lambda place: _compile(place / f"{unit}.c", text, flags))
    shutil.copyfile(found / library, folder / library)
