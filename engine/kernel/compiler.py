"""The C compiler: ``ziglang`` (a pip package), so that nothing need be installed on the machine.

Its caches are pointed into ours (it fails without a home directory otherwise): one that all builds share, for what it makes of
the system's libraries and which does not grow, and one of each build's own for our code, dropped with it. Libraries for this
machine are linked without the start files: the first link would otherwise build the compiler's own runtime for seconds. No
debugging tables (which it writes unless told not to): they cost a quarter of the time and four fifths of the size, and change no
instruction. Never fast-math: NaN tests must live.
"""

from __future__ import annotations

import logging
import os
import platform
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from engine.basics.extras import remedy, there
from engine.basics.problems import Problem, SceneError
from engine.kernel import programs

log = logging.getLogger("trunnion.kernel")

FLAGS = (
    "-std=gnu11", "-O2", "-fno-unroll-loops", "-fno-vectorize", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=fast",
    "-fomit-frame-pointer", "-fPIC", "-fvisibility=default", "-w", "-g0",
)  # fmt: skip
"""Loops are short and of lengths known late: unrolled and vectorised by the compiler the runtime takes twice as long to compile and
is 3 to 14 percent slower. What is worth vectors is written with them (``beyond.h``). Frame pointers, which
this compiler keeps unless told not to, cost generated code 2 percent."""
STRAIGHT = ("-fno-slp-vectorize",)
LONG_TEXT = {"kernel": 41_000, "outputs": 0, "linear": 0, "jacobian": 11_000}
"""Characters from which the code of a unit is compiled without a search for vectors in its straight-line code, which takes half of
the time. Stepping units are up to 10 percent faster with it while they are short (the double pendulum's 33,000 characters: 5
percent), and no longer, or 2 to 4 percent slower, from 43,000 on. Rows of columns are 2 percent faster (twelve models: 0 to 6)."""
LONG_PART = 30_000
"""The same of a part of scenes: from there on compiling takes half of the time without (free bodies, planar and rubbing ball
joints); runs of five models took −3 to 7 percent longer when all parts were so."""
AS_WRITTEN = ("-ffp-contract=off",)
ROWS = ("outputs",)
"""Units whose text is that of the columns asked for: no product is fused with a sum there, which the compiler does or leaves
according to what else it reads, so that a column is the same to the last bit whatever others are asked for (rows of all columns
take up to 3 percent longer)."""
QUICK = ("-O0", "-fno-sanitize=all", "-fno-stack-protector")
"""What a kernel is compiled with where it is to be there soon: in a third of the time, and steps take about a sixth longer.
Without optimisation this compiler adds checks unless told not to, which take all of the time won."""
TARGETS = {
    ("Linux", "x86_64"): "x86_64-linux-gnu.2.17",
    ("Linux", "aarch64"): "aarch64-linux-gnu.2.17",
    ("Windows", "AMD64"): "x86_64-windows-gnu",
    ("Darwin", "x86_64"): "x86_64-macos.11.0",
    ("Darwin", "arm64"): "aarch64-macos.11.0",
}

PLATFORMS = {
    ("Linux", "x86_64"): "manylinux_2_17_x86_64",
    ("Linux", "aarch64"): "manylinux_2_17_aarch64",
    ("Windows", "AMD64"): "win_amd64",
    ("Darwin", "x86_64"): "macosx_11_0_x86_64",
    ("Darwin", "arm64"): "macosx_11_0_arm64",
}
"""The same in the words of wheels."""


class CompilerError(RuntimeError):
    """The compiler refused generated code: a defect of Trunnion, to be reported with the file it names."""


def host_target() -> str:
    """zig target of this machine."""
    key = (platform.system(), platform.machine())
    if key not in TARGETS:
        raise CompilerError(f"no compiler target for {key[0]} on {key[1]}; supported: {sorted(TARGETS)}")
    return TARGETS[key]


def wheel_platform() -> str:
    """Platform that a wheel with libraries for this machine's target is for."""
    host_target()
    return PLATFORMS[platform.system(), platform.machine()]


def cpu_level() -> str:
    """x86-64-v3 (AVX2, FMA) where this machine has it, else the baseline."""
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
    """Version of a package that shapes what is compiled; "none" where it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def compiler_version() -> str:
    """Version of the ziglang package."""
    return version_of("ziglang")


def library_suffix() -> str:
    """Suffix of shared libraries here."""
    return {"Windows": ".dll", "Darwin": ".dylib"}.get(platform.system(), ".so")


def shared_cache(cache: Path) -> Path:
    """The compiler's cache that all builds share."""
    return cache / f"zig-{compiler_version()}"


def run(arguments: Sequence[str], cache: Path) -> None:
    """``zig cc`` with our caches; CompilerError with the compiler's words on failure. Should the shared cache be pruned under the
    build, it is made again without."""
    log.debug("compile: %s", " ".join(arguments))
    shared = shared_cache(cache)
    with tempfile.TemporaryDirectory(prefix=".compile-", dir=cache, ignore_cleanup_errors=True) as own:
        shared.mkdir(exist_ok=True)
        with suppress(OSError):
            os.utime(shared)  # it is pruned like any entry, when it is the one unused for longest
        code, complaint = _zig(arguments, shared, Path(own))
        if code:
            code, complaint = _zig(arguments, Path(own), Path(own))
    if code:
        raise CompilerError(
            "the C compiler failed on generated code; this is a defect of Trunnion, please report it with this text:\n"
            + complaint[-2000:]
        )


def _zig(arguments: Sequence[str], shared: Path, own: Path) -> tuple[int, str]:
    """The compiler's exit code and complaints, with these caches."""
    env = dict(os.environ, ZIG_GLOBAL_CACHE_DIR=str(shared), ZIG_LOCAL_CACHE_DIR=str(own))
    return programs.run([str(_program()), "cc", *arguments], env)


def needed(who: str, what: str, instead: str = "") -> None:
    """SceneError with the line to type where the packages that write and compile C are not installed. what: what is to be
    compiled; instead: another remedy."""
    missing = [m for m in ("casadi", "ziglang") if not there(m)]
    if missing:
        several = len(missing) > 1
        told = f"needs {what} compiled, and the package{'s' * several} for that, {' and '.join(missing)}"
        raise SceneError([Problem(who, f"{told}, {'are' if several else 'is'} not installed", remedy("compile") + instead)])


@lru_cache(maxsize=1)
def _program() -> Path:
    """The compiler's executable, which the package ``ziglang`` carries beside its modules (``python -m ziglang`` starts the same
    one, after an interpreter)."""
    found = find_spec("ziglang")
    if found is None or found.origin is None:
        raise SceneError([Problem("the C compiler", "is missing: the package ziglang is not installed", remedy("compile"))])
    return Path(found.origin).with_name("zig.exe" if platform.system() == "Windows" else "zig")


def part_flags(text: str) -> tuple[str, ...]:
    """Flags beyond ``FLAGS`` with which a part of scenes is compiled."""
    return STRAIGHT if len(text) > LONG_PART else ()


def quick() -> bool:
    """Whether kernels are to be there soon rather than to run fast: TRUNNION_QUICK_BUILD is set (and not to 0)."""
    return os.environ.get("TRUNNION_QUICK_BUILD", "0") != "0"


def unit_flags(unit: str, text: str) -> tuple[str, ...]:
    """Flags beyond ``FLAGS`` with which a unit of a kernel is compiled for this machine."""
    return QUICK if quick() else optimised_flags(unit, text)


def optimised_flags(unit: str, text: str) -> tuple[str, ...]:
    """The same whatever the environment says: of what is shipped."""
    straight = STRAIGHT if unit in LONG_TEXT and len(text) > LONG_TEXT[unit] else ()
    return straight + (AS_WRITTEN if unit in ROWS else ())


def machine_flags() -> list[str]:
    """Target and CPU level of this machine."""
    level = cpu_level()
    return ["-target", host_target(), *([f"-mcpu={level}"] if level else [])]


def build_object(source: Path, target: Path, cache: Path, extra: Sequence[str] = ()) -> None:
    """One object file for this machine from a C file, to be made part of a library."""
    run([*machine_flags(), *FLAGS, *extra, "-c", str(source), "-o", str(target)], cache)


def build_library(sources: Sequence[Path], library: Path, include: Sequence[Path], cache: Path, extra: Sequence[str] = ()) -> None:
    """One shared library for this machine from C files."""
    link = ["-nostdlib", "-lm", "-lc"] if platform.system() == "Linux" else []
    folders = [f"-I{p}" for p in include]
    run([*machine_flags(), *FLAGS, *extra, "-shared", *map(str, sources), *folders, "-o", str(library), *link], cache)
