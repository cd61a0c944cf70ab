"""Libraries of the installation, in a folder for each CPU level. They are the runtime, the interpreter, and the bytecode primitives
(``parts.primitives.library_prebuild``). The libraries of primitives are compressed. They are unpacked into the cache at their first
use. A checkout has no prebuilt libraries; its libraries are compiled at their first use."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path

from trunnion.basics.errors import Problem, SceneError
from trunnion.kernel.compilation import c_compiler, library_cache

ENGINE = Path(__file__).resolve().parents[2]
FOLDER = ENGINE / "_built"
SOURCES = ("columns", "elements", "kernel", "parts", "recursion", "runtime", "system")
NAMES = ("runtime", "interpreter")
PACKED = "packed"
"""Subfolder of the compressed libraries, ``<name>-<digest of the library>.xz``."""
TOLD = "sources"
"""File with the digest of the sources from which the libraries of a folder were built. If the present sources differ, the libraries
are not used."""


@lru_cache(maxsize=1)
def sources() -> str:
    """Digest of all sources of libraries, without the compiler."""
    return library_cache.digest_of_files(ENGINE, SOURCES, (".py", ".c", ".h"))


def level() -> str:
    """Folder name for this machine's CPU level."""
    return c_compiler.cpu_level() or "any"


@lru_cache(maxsize=1)
def folder() -> Path | None:
    """The folder for this machine's CPU level. If it is missing, the folder for the baseline level. If both are missing, None."""
    for name in (level(), "x86_64"):
        place = FOLDER / name
        if (place / TOLD).exists() and (place / TOLD).read_text() == sources():
            return place
    return None


def path(name: str) -> Path:
    """Path of a library of the installation, whether or not it exists."""
    return (folder() or FOLDER) / f"{name}{c_compiler.library_suffix()}"


@lru_cache(maxsize=1)
def _packed() -> dict[str, Path]:
    """{name: compressed library of the installation}."""
    place = folder()
    return {f.stem.rpartition("-")[0]: f for f in (place / PACKED).iterdir()} if place else {}


def unpacked(name: str) -> Path | None:
    """The library of the installation with this name, unpacked in the cache. None if the installation has no such library for this
    machine. Installations with the same library share the unpacked file. Raises SceneError if this Python cannot unpack."""
    file = _packed().get(name)
    if file is None:
        return None
    library = f"part{c_compiler.library_suffix()}"

    def make(folder: Path) -> None:
        try:
            import lzma  # Python can be built without this module
        except ImportError as e:
            told = "has no module lzma, which unpacks the compiled parts of the installation"
            raise SceneError([Problem("this Python", told, "use a Python that was built with liblzma")]) from e
        (folder / library).write_bytes(lzma.decompress(file.read_bytes()))

    return library_cache.entry(f"installed-{file.stem}", make)[0] / library


@lru_cache
def library(name: str) -> ctypes.CDLL | None:
    """A library of the installation, or None if there is no library for this machine."""
    return ctypes.CDLL(str(path(name))) if folder() else None
