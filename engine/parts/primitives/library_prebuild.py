"""Builds the libraries of an installation: the runtime, the bytecode interpreter, and all primitives of the catalogue."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from trunnion.kernel.c_code.code_generator import MATH
from trunnion.kernel.compilation import c_compiler, library_cache, prebuilt_libraries
from trunnion.kernel.compilation.c_compiler import Machine
from trunnion.kernel.compilation.compiler_processes import awaited, side_by_side
from trunnion.kernel.shared_libraries import compiled_runtime
from trunnion.parts.primitives.catalogue import Recipe, every
from trunnion.parts.primitives.primitive_cache import (
    build_primitive,
    compiled_interpreter,
    facts_of,
    facts_symbol,
    key_of,
    texts_key,
)

CHUNK = 150_000
"""Number of characters of C text that are compiled together: a few seconds of work, so that all processors stay busy."""


def build(folder: Path, recipes: Iterable[Recipe] | None = None, machine: Machine | None = None) -> None:
    """Build all libraries in a folder (``prebuilt_libraries.folder``). recipes: recipes of the primitives; by default, the whole
    catalogue. machine: target of the libraries; by default, this machine."""
    folder.mkdir(parents=True, exist_ok=True)
    made_for = machine or c_compiler.host()
    with side_by_side(os.cpu_count() or 2) as submit:
        whole = [submit(make, made_for) for make in (compiled_runtime, compiled_interpreter)]
        chunks = _stored_chunks() if recipes is None else _chunks(recipes)
        objects = list(map(awaited, [submit(_object, made_for, flags, text) for flags, text in chunks]))
        for library in map(awaited, whole):
            shutil.copyfile(library, folder / library.name)
    c_compiler.build_library(
        objects, folder / f"parts{made_for.suffix}", [], library_cache.cache_folder(), ("-s",), machine=made_for
    )
    (folder / prebuilt_libraries.TOLD).write_text(prebuilt_libraries.sources())
    kept = {f"{name}{made_for.suffix}" for name in prebuilt_libraries.NAMES} | {prebuilt_libraries.TOLD}
    for other in (f for f in folder.iterdir() if f.name not in kept):  # on Windows, the linker writes further files
        other.unlink()


def _object(machine: Machine, flags: tuple[str, ...], text: str) -> Path:
    """The object file of a C text without headers, from the cache or compiled. Machines that differ only in the C library share
    this file."""
    plain = replace(machine, target=machine.target.replace("-musl", "-gnu.2.17"))

    def make(folder: Path) -> None:
        (folder / "parts.c").write_text(MATH + text)
        c_compiler.build_object(folder / "parts.c", folder / "parts.o", library_cache.cache_folder(), flags, plain)
        (folder / "parts.c").unlink()

    key = library_cache.digest(MATH, text, *flags, *c_compiler.toolchain(plain))
    return library_cache.entry(f"object-{key}", make)[0] / "parts.o"


def _stored_chunks() -> Iterator[tuple[tuple[str, ...], str]]:
    """The chunks of C text of the whole catalogue. They are written once; a build for a second machine finds them in the cache."""
    file = library_cache.cache_folder() / f"texts-{texts_key()}" / "texts.json"
    if file.exists():
        yield from ((tuple(flags), text) for flags, text in json.loads(file.read_text()))
        return
    written = []
    for chunk in _chunks(every()):
        written.append(chunk)
        yield chunk

    def make(folder: Path) -> None:
        (folder / file.name).write_text(json.dumps(written))

    library_cache.entry(file.parent.name, make)


def _chunks(recipes: Iterable[Recipe]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Pairs of compiler flags and C text. A text contains primitives and their facts. If several recipes give equal primitives, it
    contains only one of them."""
    texts: dict[str, str] = {}
    begun: dict[tuple[str, ...], list[str]] = {}
    for recipe in recipes:
        primitive = build_primitive(*recipe)
        flags = c_compiler.part_flags(primitive.text)
        out = begun.setdefault(flags, [])
        out.append(f"const char {facts_symbol(key_of(*recipe))}[]={json.dumps(json.dumps(facts_of(primitive)))};\n")
        if primitive.first not in texts:
            texts[primitive.first] = primitive.text
            out.append(primitive.text)
        elif texts[primitive.first] != primitive.text:
            raise ValueError(f"two primitives have a function {primitive.first}")
        if sum(map(len, out)) > CHUNK:
            yield flags, "".join(begun.pop(flags))
    for flags, out in begun.items():
        yield flags, "".join(out)
