"""The libraries that come with an installation, built: the runtime, what walks along tapes, and the parts of scenes."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

from engine.kernel import built, cache, compiler
from engine.kernel.emit import MATH
from engine.kernel.library import compiled_runtime
from engine.kernel.programs import awaited, side_by_side
from engine.parts.every import Asked, every
from engine.parts.store import compiled_machine, facts, key_of, symbol, written

CHUNK = 150_000
"""Characters of C that are compiled together: some seconds of work, so that all processors have some to the end."""


def build(folder: Path, asked: Iterable[Asked] | None = None) -> None:
    """Build all libraries into a folder (``built.folder``). asked: parts, all that there are unless told."""
    folder.mkdir(parents=True, exist_ok=True)
    with side_by_side(os.cpu_count() or 2) as submit:
        whole = [submit(make) for make in (compiled_runtime, compiled_machine)]
        jobs, pieces = [], []
        for number, (flags, text) in enumerate(_chunks(every() if asked is None else asked)):
            (folder / f"parts{number}.c").write_text(MATH + text)
            pieces.append(folder / f"parts{number}.o")
            jobs.append(submit(compiler.build_object, pieces[-1].with_suffix(".c"), pieces[-1], cache.cache_folder(), flags))
        for job in jobs:
            awaited(job)
        for library in map(awaited, whole):
            shutil.copyfile(library, folder / library.name)
    compiler.build_library(pieces, folder / f"parts{compiler.library_suffix()}", [], cache.cache_folder())
    (folder / built.TOLD).write_text(built.sources())
    for other in [*folder.glob("*.c"), *folder.glob("*.o"), *folder.glob("*.h")]:
        other.unlink()


def _chunks(asked: Iterable[Asked]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Flags, and C text of parts that are compiled with them, with what is to be known of each. Parts of different arguments may be
    one: their functions are there once."""
    texts: dict[str, str] = {}
    begun: dict[tuple[str, ...], list[str]] = {}
    for each in asked:
        part = written(*each)
        flags = compiler.part_flags(part.text)
        out = begun.setdefault(flags, [])
        out.append(f"const char {symbol(key_of(*each))}[]={json.dumps(json.dumps(facts(part)))};\n")
        if part.first not in texts:
            texts[part.first] = part.text
            out.append(part.text)
        elif texts[part.first] != part.text:
            raise ValueError(f"two parts have a function {part.first}")
        if sum(map(len, out)) > CHUNK:
            yield flags, "".join(begun.pop(flags))
    for flags, out in begun.items():
        yield flags, "".join(out)
