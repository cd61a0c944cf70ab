"""Libraries of the installation: the runtime, and bytecode primitives (``parts.primitives.library_prebuild``), in a folder for each
CPU level. A checkout has no prebuilt libraries, and compiles at first use."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path

from trunnion.kernel.compilation import c_compiler, library_cache

ENGINE = Path(__file__).resolve().parents[2]
FOLDER = ENGINE / "_built"
SOURCES = ("columns", "elements", "kernel", "parts", "recursion", "runtime", "system")
NAMES = ("runtime", "interpreter", "parts")
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
    """The folder for this machine's CPU level, otherwise that for the baseline, otherwise None."""
    for name in (level(), "x86_64"):
        place = FOLDER / name
        if (place / TOLD).exists() and (place / TOLD).read_text() == sources():
            return place
    return None


def path(name: str) -> Path:
    """Path of a library of the installation, whether or not it exists."""
    return (folder() or FOLDER) / f"{name}{c_compiler.library_suffix()}"


@lru_cache
def library(name: str) -> ctypes.CDLL | None:
    """A library of the installation, or None if there is no library for this machine."""
    return ctypes.CDLL(str(path(name))) if folder() else None
