"""Builds the libraries of an installation: the runtime, the bytecode interpreter, and all primitives of the catalogue."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

from trunnion.kernel.c_code.code_generator import MATH
from trunnion.kernel.compilation import c_compiler, library_cache, prebuilt_libraries
from trunnion.kernel.compilation.compiler_processes import awaited, side_by_side
from trunnion.kernel.shared_libraries import compiled_runtime
from trunnion.parts.primitives.catalogue import Recipe, every
from trunnion.parts.primitives.primitive_cache import build_primitive, compiled_interpreter, facts_of, facts_symbol, key_of

CHUNK = 150_000
"""Number of characters of C text that are compiled together. They take a few seconds, so that all processors stay busy."""


def build(folder: Path, recipes: Iterable[Recipe] | None = None) -> None:
    """Build all libraries in a folder (``prebuilt_libraries.folder``). recipes: recipes of the primitives; by default, the whole
    catalogue."""
    folder.mkdir(parents=True, exist_ok=True)
    with side_by_side(os.cpu_count() or 2) as submit:
        whole = [submit(make) for make in (compiled_runtime, compiled_interpreter)]
        jobs, pieces = [], []
        for number, (flags, text) in enumerate(_chunks(every() if recipes is None else recipes)):
            (folder / f"parts{number}.c").write_text(MATH + text)
            pieces.append(folder / f"parts{number}.o")
            jobs.append(
                submit(c_compiler.build_object, pieces[-1].with_suffix(".c"), pieces[-1], library_cache.cache_folder(), flags)
            )
        for job in jobs:
            awaited(job)
        for library in map(awaited, whole):
            shutil.copyfile(library, folder / library.name)
    c_compiler.build_library(pieces, folder / f"parts{c_compiler.library_suffix()}", [], library_cache.cache_folder())
    (folder / prebuilt_libraries.TOLD).write_text(prebuilt_libraries.sources())
    for other in [*folder.glob("*.c"), *folder.glob("*.o"), *folder.glob("*.h")]:
        other.unlink()


def _chunks(recipes: Iterable[Recipe]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Pairs of compiler flags and of the C text for these flags. A text contains primitives and their facts. If several recipes
    give equal primitives, the text contains only one of them."""
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
