"""The C compiler, from the pip package ``ziglang``. No other compiler is needed. This compiler fails without a home directory, so
its caches are redirected. Builds share one cache of constant size for system libraries. Each build also has a cache that is deleted
after the build. Libraries for this machine are linked without start files, because the first build of these files would take
seconds. Debug tables are off, because they take a quarter of the time and four fifths of the size. Fast-math is never used, because
tests for NaN must work."""

from __future__ import annotations

import logging
import os
import platform
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path

from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.optional_packages import remedy, there
from trunnion.kernel.compilation import compiler_processes

log = logging.getLogger("trunnion.kernel")

FLAGS = (
    "-std=gnu11", "-O2", "-fno-unroll-loops", "-fno-vectorize", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=fast",
    "-fomit-frame-pointer", "-fPIC", "-fvisibility=default", "-w", "-g0",
)  # fmt: skip
"""Flags of all units. Automatic unrolling and vectorisation are off, because loops are short and their lengths are known only at
run time. With unrolling and vectorisation, the runtime takes twice as long to compile, and is 3 to 14 percent slower. Important
loops are written with vectors (``base/compiler.h``). Frame pointers are off, because they slow generated code by 2 percent."""
STRAIGHT = ("-fno-slp-vectorize",)
LONG_TEXT = {"kernel": 41_000, "outputs": 0, "linear": 0, "jacobian": 11_000}
"""Number of characters of a unit's text above which straight-line code is not vectorised. This vectorisation takes half of the
compile time. The vectorisation makes short stepping units up to 10 percent faster (double pendulum, 33,000 characters: 5 percent).
Units above 43,000 characters become 2 to 4 percent slower, and rows of columns 2 percent (twelve models: 0 to 6)."""
LONG_PART = 30_000
"""Like ``LONG_TEXT``, for a bytecode primitive. Without this vectorisation, free bodies and ball joints with friction compile
in half of the time. The run times of five models then changed by −3 to +7 percent."""
AS_WRITTEN = ("-ffp-contract=off",)
ROWS = ("outputs",)
"""Units compiled without contraction of products and sums into fused operations. The compiler chooses contractions by the
surrounding text, so the last bit of a column would depend on the other columns. Without contraction, a row with all columns takes
up to 3 percent longer."""
QUICK = ("-O0", "-fno-sanitize=all", "-fno-stack-protector")
"""Flags for fast builds, which take a third of the compile time and give steps that are a sixth slower. Without optimisation, this
compiler would add run-time checks. The checks are off, because they would cancel the gain."""


@dataclass(frozen=True)
class Machine:
    """A kind of machine for which libraries are compiled. target: zig target. cpu: instruction-set level; "" is the default level
    of the target."""

    target: str
    cpu: str

    @property
    def system(self) -> str:
        """Operating system: "linux", "windows" or "macos"."""
        return self.target.split("-")[1].partition(".")[0]

    @property
    def suffix(self) -> str:
        """Suffix of shared libraries."""
        return SUFFIXES.get(self.system, ".so")

    @property
    def level(self) -> str:
        """Name of the folder that holds this machine's libraries in a wheel."""
        return self.cpu or "any"

    def flags(self) -> list[str]:
        """Options of the compiler."""
        return ["-target", self.target, *([f"-mcpu={self.cpu}"] if self.cpu else [])]


SUFFIXES = {"windows": ".dll", "macos": ".dylib", "darwin": ".dylib"}
MACHINES = {
    "manylinux_2_17_x86_64": Machine("x86_64-linux-gnu.2.17", "x86_64"),
    "musllinux_1_2_x86_64": Machine("x86_64-linux-musl", "x86_64"),
    "manylinux_2_17_aarch64": Machine("aarch64-linux-gnu.2.17", ""),
    "musllinux_1_2_aarch64": Machine("aarch64-linux-musl", ""),
    "macosx_11_0_arm64": Machine("aarch64-macos.11.0", ""),
    "macosx_11_0_x86_64": Machine("x86_64-macos.11.0", "x86_64"),
    "win_amd64": Machine("x86_64-windows-gnu", "x86_64"),
}
"""The machines on which a wheel's libraries run, by the wheel's platform tag. Every x86-64 processor has the level x86_64."""
TAGS = {
    ("linux", "x86_64"): "manylinux_2_17_x86_64",
    ("linux", "aarch64"): "manylinux_2_17_aarch64",
    ("windows", "amd64"): "win_amd64",
    ("darwin", "x86_64"): "macosx_11_0_x86_64",
    ("darwin", "arm64"): "macosx_11_0_arm64",
}
"""Platform tag by system and processor. For a Python that uses musl, ``wheel_platform`` replaces manylinux."""


SYSTEM_LIBRARIES = {
    "linux": ("-nostdlib", "-lm", "-lc"),
    "windows": ("-nostdlib", *(f"-lapi-ms-win-crt-{part}-l1-1-0" for part in ("math", "heap", "stdio", "string", "private"))),
}
"""Linker options by operating system. A library uses the system's C library, but not the compiler's start files and libraries.
Their build for Windows would take over a minute. ``ADDED_SOURCES`` defines the functions that are then missing."""
WINDOWS = Path(__file__).with_name("windows_libc.c")
ADDED_SOURCES = {"windows": (WINDOWS,)}
"""C files that every library for an operating system contains in addition to its own files."""


class CompilerError(RuntimeError):
    """The compiler rejected generated code (a defect of Trunnion), or does not support this machine."""


def wheel_platform() -> str:
    """Platform tag of a wheel for this machine. Raises CompilerError if the machine is not supported."""
    key = (platform.system().lower(), platform.machine().lower())
    if key not in TAGS:
        raise CompilerError(f"no compiler target for {key[0]} on {key[1]}; supported: {sorted(TAGS)}")
    musl = "musl" in EXTENSION_SUFFIXES[0]
    return TAGS[key].replace("manylinux_2_17", "musllinux_1_2") if musl else TAGS[key]


def host() -> Machine:
    """This machine, with its instruction-set level. Raises CompilerError if the machine is not supported."""
    return replace(MACHINES[wheel_platform()], cpu=cpu_level())


def cpu_level() -> str:
    """CPU level of compiled code: x86-64-v3 (AVX2, FMA) if this machine supports it, otherwise the baseline. TRUNNION_CPU overrides
    the choice. The result is "" for processors other than x86-64."""
    if platform.machine() not in ("x86_64", "AMD64"):
        return ""
    if os.environ.get("TRUNNION_CPU"):
        return os.environ["TRUNNION_CPU"]
    try:
        flags = Path("/proc/cpuinfo").read_text().split("flags", 1)[1].split("\n", 1)[0].split()
    except (OSError, IndexError):
        return "x86_64_v2" if platform.system() == "Darwin" else "x86_64"
    return "x86_64_v3" if {"avx2", "fma", "bmi2"} <= set(flags) else "x86_64"


def version_of(package: str) -> str:
    """Version of a package that influences compiled code; "none" if the package is not installed."""
    found = _installed(tuple(sys.path)).get(package.lower().replace("-", "_"), [])
    if len(found) == 1:
        return found[0]
    from importlib.metadata import PackageNotFoundError, distribution  # imported here, because the import takes 7 % of a start

    try:
        return distribution(package).version
    except PackageNotFoundError:
        return "none"


@lru_cache(maxsize=4)
def _installed(folders: tuple[str, ...]) -> dict[str, list[str]]:
    """Versions of each installed package, from the names of the folders ``*.dist-info``."""
    out: dict[str, list[str]] = {}
    for folder in folders:
        with suppress(OSError):
            for name in os.listdir(folder):
                package, _, version = name.removesuffix(".dist-info").partition("-")
                if name.endswith(".dist-info"):
                    out.setdefault(package.lower(), []).append(version)
    return out


def compiler_version() -> str:
    """Version of the ziglang package."""
    return version_of("ziglang")


def library_suffix() -> str:
    """Suffix of shared libraries on this platform."""
    return SUFFIXES.get(platform.system().lower(), ".so")


def toolchain(machine: Machine | None = None) -> tuple[str, ...]:
    """Everything that determines compiled code for a machine (by default this machine), except the sources of a library."""
    chosen = machine or host()
    added = (file.read_text() for file in ADDED_SOURCES.get(chosen.system, ()))
    return (compiler_version(), chosen.target, chosen.cpu, *FLAGS, *added)


def shared_cache(cache: Path) -> Path:
    """The compiler's cache that all builds share."""
    return cache / f"zig-{compiler_version()}"


def run(arguments: Sequence[str], cache: Path) -> None:
    """Run ``zig cc`` with caches in the folder ``cache``. After a failure, the compiler runs again without the shared cache,
    because another process may have pruned that cache. A second failure raises CompilerError with the compiler's output."""
    log.debug("compile: %s", " ".join(arguments))
    shared = shared_cache(cache)
    with tempfile.TemporaryDirectory(prefix=".compile-", dir=cache, ignore_cleanup_errors=True) as own:
        shared.mkdir(exist_ok=True)
        with suppress(OSError):
            os.utime(shared)  # marks the cache as recently used, so that pruning keeps it
        code, complaint = _zig(arguments, shared, Path(own))
        if code:
            code, complaint = _zig(arguments, Path(own), Path(own))
    if code:
        raise CompilerError(
            "the C compiler failed on generated code; this is a defect of Trunnion, please report it with this text:\n"
            + complaint[-2000:]
        )


def _zig(arguments: Sequence[str], shared: Path, own: Path) -> tuple[int, str]:
    """Exit code and output of a run of the compiler with these caches."""
    env = dict(os.environ, ZIG_GLOBAL_CACHE_DIR=str(shared), ZIG_LOCAL_CACHE_DIR=str(own))
    return compiler_processes.run([str(_program()), "cc", *arguments], env)


def needed(who: str, what: str, instead: str = "") -> None:
    """Raise SceneError with the installation command, unless the packages that write and compile C are installed. what: name of the
    object to compile. instead: text of another remedy."""
    missing = [m for m in ("casadi", "ziglang") if not there(m)]
    if missing:
        several = len(missing) > 1
        told = f"needs {what} compiled, and the package{'s' * several} for that, {' and '.join(missing)}"
        raise SceneError([Problem(who, f"{told}, {'are' if several else 'is'} not installed", remedy("compile") + instead)])


@lru_cache(maxsize=1)
def _program() -> Path:
    """The compiler's executable in the package ``ziglang``. (``python -m ziglang`` would start the compiler through another Python
    interpreter.)"""
    found = find_spec("ziglang")
    if found is None or found.origin is None:
        raise SceneError([Problem("the C compiler", "is missing: the package ziglang is not installed", remedy("compile"))])
    return Path(found.origin).with_name("zig.exe" if platform.system() == "Windows" else "zig")


def part_flags(text: str) -> tuple[str, ...]:
    """Additional flags for a primitive with this C text."""
    return STRAIGHT if len(text) > LONG_PART else ()


def quick() -> bool:
    """Whether fast builds are preferred: TRUNNION_QUICK_BUILD is set and not 0."""
    return os.environ.get("TRUNNION_QUICK_BUILD", "0") != "0"


def unit_flags(unit: str, text: str) -> tuple[str, ...]:
    """Additional flags for a unit of a kernel on this machine."""
    return QUICK if quick() else optimised_flags(unit, text)


def optimised_flags(unit: str, text: str) -> tuple[str, ...]:
    """Additional flags for a unit in an optimised build. These flags do not depend on the environment."""
    straight = STRAIGHT if unit in LONG_TEXT and len(text) > LONG_TEXT[unit] else ()
    return straight + (AS_WRITTEN if unit in ROWS else ())


def build_object(source: Path, target: Path, cache: Path, extra: Sequence[str] = (), machine: Machine | None = None) -> None:
    """Compile a C file to an object file of a library for a machine, by default this machine."""
    run([*(machine or host()).flags(), *FLAGS, *extra, "-c", str(source), "-o", str(target)], cache)


def build_library(
    sources: Sequence[Path],
    library: Path,
    include: Sequence[Path],
    cache: Path,
    extra: Sequence[str] = (),
    machine: Machine | None = None,
) -> None:
    """Compile C files to a shared library for a machine, by default this machine."""
    made_for = machine or host()
    link = [f"-Wl,-install_name,@rpath/{library.name}"] if made_for.system == "macos" else SYSTEM_LIBRARIES.get(made_for.system, ())
    options = [*made_for.flags(), *FLAGS, *extra]
    folders = [f"-I{p}" for p in include]
    if made_for.system == "windows":  # without the start files of Windows, the compiler does not find the headers of Windows
        everything = (*sources, *ADDED_SOURCES["windows"])
        sources = [_object(source, library.parent, options + folders, cache) for source in everything]
        options.append("-s")  # strip symbols, which contain the path of the build folder
    run([*options, "-shared", *map(str, sources), *folders, "-o", str(library), *link], cache)


def _object(source: Path, folder: Path, options: Sequence[str], cache: Path) -> Path:
    """The object file of a source, compiled into a folder. A source that is an object file is returned unchanged."""
    made = source if source.suffix == ".o" else folder / f"{source.stem}.o"
    if made != source:
        run([*options, "-c", str(source), "-o", str(made)], cache)
    return made
