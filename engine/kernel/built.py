"""Libraries that came with the installation: the runtime, and parts of scenes (``parts.building``). They are for one level of
processors, a folder each; a source tree has none, and builds on first use."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path

from engine.kernel import cache, compiler

ENGINE = Path(__file__).resolve().parent.parent
FOLDER = ENGINE / "_built"
SOURCES = ("abi", "contact", "friction", "integrators", "joints", "kernel", "parts", "recursion", "runtime", "system")
NAMES = ("runtime", "machine", "parts")
TOLD = "sources"
"""File of a folder that tells from which sources its libraries were built; beside others they are not used."""


@lru_cache(maxsize=1)
def sources() -> str:
    """Digest of all sources that libraries are built from, whatever compiles them."""
    files = sorted(f for folder in SOURCES for pattern in ("*.py", "*.[ch]") for f in (ENGINE / folder).glob(pattern))
    return cache.digest(*(f.read_bytes() for f in files))


def level() -> str:
    """Name of the folder for processors of this machine's level."""
    return compiler.cpu_level() or "any"


@lru_cache(maxsize=1)
def folder() -> Path | None:
    """The folder for this machine: of its own level, else of one that every machine has."""
    for name in (level(), "x86_64"):
        with_them = FOLDER / name
        if (with_them / TOLD).exists() and (with_them / TOLD).read_text() == sources():
            return with_them
    return None


def path(name: str) -> Path:
    """Where a library of the installation is, or would be."""
    return (folder() or FOLDER) / f"{name}{compiler.library_suffix()}"


@lru_cache
def library(name: str) -> ctypes.CDLL | None:
    """A library of the installation; None where it has none for this machine."""
    return ctypes.CDLL(str(path(name))) if folder() else None
