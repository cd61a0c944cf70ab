"""Builds the shared libraries of an exported model for all platforms. The compiler ``ziglang`` compiles for each platform on any
other platform."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from trunnion.basics.errors import Problem, SceneError
from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.kernel.compilation.c_compiler import SYSTEM_LIBRARIES, WINDOWS
from trunnion.kernel.compilation.compiler_processes import awaited, side_by_side
from trunnion.kernel.shared_libraries import RUNTIME, runtime_key, write_headers
from trunnion.parts.primitives.primitive_cache import BYTECODE, INTERPRETER
from trunnion.runtime.abi.entry_points import entry_points

NATIVE = Path(__file__).resolve().parents[1] / "native"
LIBRARY = NATIVE.parent / "c_library" / "templates"
FLAGS = (*(f for f in c_compiler.FLAGS if f != "-fvisibility=default"), "-fvisibility=hidden", "-s")

PARTS: dict[str, tuple[str, ...]] = {"parts": (), "long_parts": c_compiler.STRAIGHT}
"""The generated files that hold precompiled primitives, each with the compiler flags that the engine uses for primitives
(``c_compiler.part_flags``), in addition to ``FLAGS``."""


@dataclass(frozen=True)
class Platform:
    """A platform of FMI. The FMU has one folder in ``binaries`` for each platform. suffix: file suffix of the platform's library.
    targets: pairs (compiler target, CPU). The libraries of two targets are joined into one file."""

    suffix: str
    targets: tuple[tuple[str, str], ...]


PLATFORMS = {
    "linux64": Platform(".so", (("x86_64-linux-gnu.2.17", "x86_64"),)),
    "win64": Platform(".dll", (("x86_64-windows-gnu", "x86_64"),)),
    "darwin64": Platform(".dylib", (("x86_64-macos.10.15", "x86_64"), ("aarch64-macos.11.0", "apple_m1"))),
    "aarch64-darwin": Platform(".dylib", (("aarch64-macos.11.0", "apple_m1"),)),
    "aarch64-linux": Platform(".so", (("aarch64-linux-gnu.2.17", "generic"),)),
    "aarch64-windows": Platform(".dll", (("aarch64-windows-gnu", "generic"),)),
}
NAMES = {
    "2.0": {n: n for n in ("linux64", "win64", "darwin64", "aarch64-darwin")} | {"aarch64-linux": "linux64"},
    "3.0": {
        "linux64": "x86_64-linux",
        "win64": "x86_64-windows",
        "darwin64": "x86_64-darwin",
        "aarch64-darwin": "aarch64-darwin",
        "aarch64-linux": "aarch64-linux",
        "aarch64-windows": "aarch64-windows",
    },
}
"""{standard: {platform: name of its folder}}."""
ALONE = {"2.0": "aarch64-linux"}
"""{standard: platform that shares the folder of another platform}. An FMU contains only one of these two platforms."""
NARROW = ("linux32", "win32", "x86-linux", "x86-windows")
"""Platforms of both standards for which no libraries are built. The sources run there."""
INSIDE = "fmu_"
"""Prefix of the model's functions in ``native/standards``."""
ENTRIES = {
    "2.0": ("fmi2Functions.h", "fmi2FunctionTypes.h"),
    "3.0": ("fmi3Functions.h", "fmi3FunctionTypes.h"),
    "library": ("mechanism.h", "mechanism.h.txt"),
}
"""{kind of export: (header with the functions, file that lists their types)}."""
SHELL_NAMES = {"2.0": "FMU_FMI2", "3.0": "FMU_FMI3", "library": "FMU_ALONE"}
"""The macro that is defined when ``native/translation_unit.c`` is compiled. The key is the kind of export: an FMI version, or a
plain C library."""
HOSTS = {
    ("Linux", "x86_64"): "linux64", ("Linux", "aarch64"): "aarch64-linux", ("Windows", "AMD64"): "win64",
    ("Windows", "ARM64"): "aarch64-windows", ("Darwin", "x86_64"): "darwin64", ("Darwin", "arm64"): "darwin64",
}  # fmt: skip


def chosen(names: Sequence[str], standard: str = "2.0") -> list[str]:
    """The names of the platforms to build. names: "host", "all", or platform names of FMI 2.0 or 3.0. Raises SceneError for any
    other name."""
    out: list[str] = []
    folders = NAMES[standard]
    also = {folder: name for name, folder in NAMES["3.0"].items()}
    for name in names or ("host",):
        if name == "host":
            name = HOSTS.get((platform.system(), platform.machine()), f"{platform.system()} {platform.machine()}".lower())
        name = also.get(name, name)
        if name in PLATFORMS and name not in folders:
            raise SceneError([Problem("--platform", f"FMI {standard} has no folder for {name}", "choose --fmi 3")])
        if name in NARROW:
            what = f"{name} has 32 bits, and 32-bit libraries would not set the floating-point environment"
            raise SceneError([Problem("--platform", what, "omit --platform, add --sources, and compile them on that machine")])
        if name != "all" and name not in folders:
            known = f"all, host, {', '.join(folders)}"
            raise SceneError([Problem("--platform", f"{name!r} is not a supported platform", known)])
        out += [p for p in folders if p != ALONE.get(standard)] if name == "all" else [name]
    if ALONE.get(standard) in out and len(set(out)) > 1:
        what = f"FMI {standard} has one folder for 64-bit Linux, so {ALONE[standard]} excludes other platforms"
        raise SceneError([Problem("--platform", what, "export this platform alone, or choose --fmi 3")])
    return [p for p in folders if p in out]


def headers() -> Path:
    """The folder of the FMI headers, which the package fmpy contains."""
    found = importlib.util.find_spec("fmpy")
    if found is None or found.origin is None:
        missing = "fmpy, which brings the FMI headers, is not installed"
        raise SceneError([Problem("trunnion fmu", missing, "pip install 'trunnion[fmu]'")])
    return Path(found.origin).parent / "c-code"


def library(name: str, identifier: str, sources: dict[str, str], standard: str = "2.0") -> bytes:
    """The shared library for a platform, from the cache or built. The library contains the FMI functions, the runtime, and the
    generated ``sources``.
    """
    place = PLATFORMS[name]
    parts = [_part(target, cpu, identifier, sources, place.suffix, standard) for target, cpu in place.targets]
    return parts[0] if len(parts) == 1 else fat(parts)


def prepare(names: Sequence[str], sources: dict[str, str], standard: str = "2.0") -> None:
    """Compile the object files of several platforms in parallel, except the files in the cache. Ctrl-C ends all compilers."""
    targets = list(dict.fromkeys(t for n in names for t in PLATFORMS[n].targets))
    files = [f for f in sources if f != "model"]
    with side_by_side(os.cpu_count() or 1) as submit:
        for job in [submit(_constant, *t) for t in targets]:
            awaited(job)
        jobs = [submit(_object, *t, f, sources[f]) for f in sorted(files, key=lambda f: -len(sources[f])) for t in targets]
        jobs += [submit(_shell, *t, standard) for t in targets]
        jobs += [submit(_interpreter, *t) for t in targets if "parts" in sources]
        for job in jobs:
            awaited(job)


def entries(kind: str) -> str:
    """The C text of the functions that hosts call. kind: a key of SHELL_NAMES."""
    header, types = ENTRIES[kind]
    declared = ((LIBRARY if kind == "library" else headers()) / types).read_text().replace("@name@", "mechanism")
    return entry_points(header, declared, inside=INSIDE)


def shell_key() -> str:
    """Digest of those C sources that do not depend on the model: the functions of the standard (the shell) and the runtime."""
    files = [*sorted(NATIVE.rglob("*.[ch]")), WINDOWS]
    return library_cache.digest(runtime_key(), *(f.read_bytes() for f in files), *FLAGS)


def _cached(kind: str, make: Callable[[Path], None], *determined_by: str | bytes) -> Path:
    """A folder of the cache. If the folder does not exist, ``make`` fills a new one. determined_by: everything that determines the
    folder's contents, except the sources of ``shell_key``."""
    return library_cache.entry(f"{kind}-{library_cache.digest(shell_key(), *determined_by)}", make)[0]


def _part(target: str, cpu: str, identifier: str, sources: dict[str, str], suffix: str, standard: str) -> bytes:
    flags = {file: c_compiler.optimised_flags(file, text) for file, text in sources.items()}
    interpreter = [f.read_bytes() for f in INTERPRETER] if "parts" in sources else []
    texts = [x for f in sorted(sources) for x in (f, sources[f], *flags[f])]
    key = library_cache.digest(shell_key(), standard, entries(standard), *interpreter, target, cpu, identifier, *texts)

    def make(folder: Path) -> None:
        constant, shell = _constant(target, cpu), _shell(target, cpu, standard)
        for file, text in sources.items():
            if file == "model":
                _unit(target, cpu, folder, file, text, flags[file])
            else:
                shutil.copyfile(_object(target, cpu, file, text), folder / f"{file}.o")
        interpreter = [] if "parts" not in sources else sorted(_interpreter(target, cpu).glob("*.o"))
        shared = [*sorted(constant.glob("*.o")), *sorted(shell.glob("*.o")), *interpreter]
        objects = [*shared, *(folder / f"{file}.o" for file in sources)]
        link = list(SYSTEM_LIBRARIES.get(_system(target), ()))
        if _system(target) == "macos":
            link = [f"-Wl,-install_name,@rpath/{identifier}{suffix}"]
        _compile(target, cpu, constant, ["-shared", *map(str, objects), "-o", str(folder / f"library{suffix}"), *link])

    return (library_cache.entry(f"fmu-{key}", make)[0] / f"library{suffix}").read_bytes()


def _object(target: str, cpu: str, file: str, text: str) -> Path:
    """The object file of a generated file other than ``model``, from the cache or compiled. FMUs of both standards share this
    object file. Models with the same kinds of parts share the object file of the parts."""
    flags = PARTS[file] if file in PARTS else c_compiler.optimised_flags(file, text)

    def make(folder: Path) -> None:
        _unit(target, cpu, folder, file, text, flags)

    return _cached("unit", make, target, cpu, file, text, *flags) / f"{file}.o"


def _unit(target: str, cpu: str, folder: Path, file: str, text: str, flags: Sequence[str]) -> None:
    (folder / f"{file}.c").write_text(text)
    _compile(target, cpu, _constant(target, cpu), [*flags, "-c", str(folder / f"{file}.c"), "-o", str(folder / f"{file}.o")])


def _constant(target: str, cpu: str) -> Path:
    """The folder with the generated headers and the object files of the runtime. All FMUs for a target share this folder."""

    def make(folder: Path) -> None:
        write_headers(folder)
        _compile_with_libc(target, cpu, folder, RUNTIME / "runtime.c")

    return _cached("runtime", make, target, cpu)


def _shell(target: str, cpu: str, standard: str) -> Path:
    """The folder with the object files of a standard's functions (the shell) and of its entry points. All FMUs of one standard and
    one target share this folder."""
    name, text = SHELL_NAMES[standard], entries(standard)

    def make(folder: Path) -> None:
        unit = [f"-D{name}", "-c", str(NATIVE / "translation_unit.c"), "-o", str(folder / "shell.o")]
        _compile(target, cpu, _constant(target, cpu), unit)
        _unit(target, cpu, folder, "entry_points", text, ())

    return _cached("shell", make, name, text, target, cpu)


def loader(name: str) -> bytes:
    """The library that a host loads from an FMU of the python flavour (``native/pythonfmu_loader.c``). All FMUs for a platform have
    the same library."""
    place, ((target, cpu),) = PLATFORMS[name], PLATFORMS[name].targets
    more = ["-lkernel32"] if _system(target) == "windows" else ["-ldl"]

    def make(folder: Path) -> None:
        _compile_with_libc(target, cpu, folder, NATIVE / "pythonfmu_loader.c")
        link = [*map(str, sorted(folder.glob("*.o"))), *SYSTEM_LIBRARIES[_system(target)], *more]
        _compile(target, cpu, folder, ["-shared", "-o", str(folder / f"loader{place.suffix}"), *link])

    return (_cached("loader", make, target, cpu) / f"loader{place.suffix}").read_bytes()


def _interpreter(target: str, cpu: str) -> Path:
    """The folder with the object files of the bytecode interpreter, which models made of parts need."""

    def make(folder: Path) -> None:
        for source in (f for f in INTERPRETER if f.suffix == ".c"):
            unit = ["-c", str(source), "-o", str(folder / f"{source.stem}.o")]
            _compile(target, cpu, _constant(target, cpu), [f"-I{BYTECODE}", *unit])

    return _cached("interpreter", make, *(f.read_bytes() for f in INTERPRETER), target, cpu)


def _system(target: str) -> str:
    """The operating system of a compiler target; for "x86_64-linux-gnu.2.17" the result is "linux"."""
    return target.split("-")[1].partition(".")[0]


def _compile_with_libc(target: str, cpu: str, folder: Path, source: Path) -> None:
    """Compile a source into a folder, which holds the generated headers. For Windows, also compile the functions that the C library
    of Windows lacks."""
    for file in (source, *([WINDOWS] if _system(target) == "windows" else [])):
        _compile(target, cpu, folder, ["-c", str(file), "-o", str(folder / f"{file.stem}.o")])


def _compile(target: str, cpu: str, generated: Path, arguments: list[str]) -> None:
    """Run the compiler with the common options of a target. generated: the folder of generated headers."""
    include = [f"-I{p}" for p in (RUNTIME, NATIVE, generated, headers())]
    c_compiler.run(["-target", target, f"-mcpu={cpu}", *FLAGS, *arguments, *include], library_cache.cache_folder())


CPU_TYPES = {b"\x07\x00\x00\x01": 0x01000007, b"\x0c\x00\x00\x01": 0x0100000C}


def fat(parts: list[bytes]) -> bytes:
    """Mach-O files for several processors, joined into one universal file. The header has one record for each processor: CPU type,
    CPU subtype, offset, size and alignment, all big-endian."""
    align = 14
    offset, records, body = 1 << align, b"", b""
    for part in parts:
        cpu, subtype = CPU_TYPES[part[4:8]], struct.unpack("<I", part[8:12])[0]
        records += struct.pack(">IIIII", cpu, subtype, offset + len(body), len(part), align)
        body += part + bytes(-len(part) % (1 << align))
    head = struct.pack(">II", 0xCAFEBABE, len(parts)) + records
    return head + bytes(offset - len(head)) + body
