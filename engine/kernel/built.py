"""Libraries that came with the installation: the runtime, and parts of scenes (``parts.building``). They are for one level of
processors, a folder each. A source tree has none: it takes those of an installation of the same sources (Python started in a
checkout imports the tree), or builds on first use."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Iterator
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


def _places() -> Iterator[Path]:
    """Where libraries may lie: beside this package, and beside others of its name that Python would find after it."""
    yield FOLDER
    yield from (Path(entry) / ENGINE.name / FOLDER.name for entry in sys.path)


@lru_cache(maxsize=1)
def folder() -> Path | None:
    """The folder for this machine: of its own level, else of one that every machine has."""
    for place in _places():
        for name in (level(), "x86_64"):
            with_them = place / name
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
