"""Builds the libraries of an installation: the runtime, the bytecode interpreter, and all primitives of the catalogue. Each joint
type has a compressed library of its primitives."""

from __future__ import annotations

import json
import lzma
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

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
from trunnion.parts.primitives.primitive_keys import library_name

if TYPE_CHECKING:
    from concurrent.futures import Future

CHUNK = 150_000
"""Number of characters of C text that are compiled together: a few seconds of work, so that all processors stay busy."""
Chunk = tuple[str, tuple[str, ...], str]
"""Name of a library, compiler flags, and C text that contains primitives and their facts."""


def build(folder: Path, recipes: Iterable[Recipe] | None = None, machine: Machine | None = None) -> None:
    """Build all libraries in a folder (``prebuilt_libraries.folder``). recipes: recipes of the primitives; by default, the whole
    catalogue. machine: target of the libraries; by default, this machine."""
    folder.mkdir(parents=True, exist_ok=True)
    made_for = machine or c_compiler.host()
    packed = folder / prebuilt_libraries.PACKED
    shutil.rmtree(packed, ignore_errors=True)
    packed.mkdir()
    with side_by_side(os.cpu_count() or 2) as submit:
        whole = [submit(make, made_for) for make in (compiled_runtime, compiled_interpreter)]
        objects: dict[str, list[Future[Path]]] = {}
        for name, flags, text in _stored_chunks() if recipes is None else _chunks(recipes):
            objects.setdefault(name, []).append(submit(_object, made_for, flags, text))
        linked = {name: list(map(awaited, futures)) for name, futures in objects.items()}
        packs = [submit(_pack, name, files, packed, made_for) for name, files in linked.items()]
        for pack in packs:
            awaited(pack)
        for library in map(awaited, whole):
            shutil.copyfile(library, folder / library.name)
    (folder / prebuilt_libraries.TOLD).write_text(prebuilt_libraries.sources())


def _pack(name: str, objects: list[Path], folder: Path, machine: Machine) -> None:
    """Link object files to a library, and write it compressed in a folder."""
    with tempfile.TemporaryDirectory() as place:
        library = Path(place) / f"{name}{machine.suffix}"
        c_compiler.build_library(objects, library, [], library_cache.cache_folder(), ("-s",), machine=machine)
        content = library.read_bytes()
    (folder / f"{name}-{library_cache.digest(content)}.xz").write_bytes(lzma.compress(content))


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


def _stored_chunks() -> Iterator[Chunk]:
    """The chunks of the whole catalogue. The first build writes the chunks; a build for a second machine finds them in the
    cache."""
    file = library_cache.cache_folder() / f"texts-{texts_key()}" / "texts.json"
    if file.exists():
        yield from ((name, tuple(flags), text) for name, flags, text in json.loads(file.read_text()))
        return
    written = []
    for chunk in _chunks(every()):
        written.append(chunk)
        yield chunk

    def make(folder: Path) -> None:
        (folder / file.name).write_text(json.dumps(written))

    library_cache.entry(file.parent.name, make)


def _chunks(recipes: Iterable[Recipe]) -> Iterator[Chunk]:
    """Chunks with all primitives. If several recipes of a library give equal primitives, the library contains only one of them."""
    texts: dict[tuple[str, str], str] = {}
    begun: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for recipe in recipes:
        primitive = build_primitive(*recipe)
        name, flags = library_name(recipe), c_compiler.part_flags(primitive.text)
        out = begun.setdefault((name, flags), [])
        out.append(f"const char {facts_symbol(key_of(*recipe))}[]={json.dumps(json.dumps(facts_of(primitive)))};\n")
        if (name, primitive.first) not in texts:
            texts[name, primitive.first] = primitive.text
            out.append(primitive.text)
        elif texts[name, primitive.first] != primitive.text:
            raise ValueError(f"two primitives have a function {primitive.first}")
        if sum(map(len, out)) > CHUNK:
            yield name, flags, "".join(begun.pop((name, flags)))
    for (name, flags), out in begun.items():
        yield name, flags, "".join(out)
