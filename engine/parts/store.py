"""Parts as they are kept. What a scene needs to know of a part is found by what makes it, the arguments of the function that writes
it; only a part that this machine has not met yet is written with symbols and compiled."""

from __future__ import annotations

import ctypes
import json
import os
from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache as cache_of
from functools import lru_cache, partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.abi.header import header
from engine.basics.interrupts import held
from engine.kernel import built, cache, compiler
from engine.kernel.library import sources_key
from engine.kernel.programs import awaited, side_by_side
from engine.parts.known import Part

FOLDER = Path(__file__).parent
MACHINE = [FOLDER / name for name in ("machine.c", "along.c", "coupled.c", "foot.c", "machine.h")]


class _Kept:
    """Stands for a module whose functions write parts: they are called only for parts that are not kept."""

    def __init__(self, module: str):
        self._module = module

    def __getattr__(self, name: str) -> Callable[..., Part]:
        made = cache_of(partial(part, self._module, name))
        setattr(self, name, made)
        return made


if TYPE_CHECKING:
    from engine.parts import body, closing, devices, friction, inverse, small, tangents
else:
    MODULES = "body", "closing", "devices", "friction", "inverse", "small", "tangents"
    body, closing, devices, friction, inverse, small, tangents = map(_Kept, MODULES)


def part(module: str, name: str, *arguments: Hashable) -> Part:
    """The part that a function of a module of parts writes from these arguments."""
    key = key_of(module, name, *arguments)
    found = _installed(key) or _known(key) or replace(written(module, name, *arguments), key=key)
    return replace(found, made=(module, name, arguments))


def key_of(*asked: Hashable) -> str:
    """By which a part is kept: a digest of the module, function and arguments that make it."""
    return cache.digest(repr(asked))


def written(module: str, name: str, *arguments: Hashable) -> Part:
    """The same, written anew. SceneError where what writes and compiles parts is not installed."""
    compiler.needed("this scene", f"a part that did not come with the installation ({module}.{name})")
    from engine.recursion.direct import direct_operators

    with direct_operators():
        made: Part = getattr(import_module(f"engine.parts.{module}"), name)(*arguments)
    return made


def _installed(key: str) -> Part | None:
    """A part that came with the installation, whose library tells what is to be known of it, too."""
    library = built.library("parts")
    if library is None:
        return None
    try:
        text = ctypes.cast(getattr(library, symbol(key)), ctypes.c_char_p).value
    except AttributeError:
        return None
    return _told(json.loads(text or b""), key, built.path("parts"))


def symbol(key: str) -> str:
    """What the facts of a part are called in a library of many."""
    return f"tr_part_{key}"


def facts(part: Part) -> dict[str, Any]:
    """What is to be known of a part."""
    return {"places": part.places, "sizes": part.sizes}


def _told(facts: dict[str, Any], key: str, library: Path) -> Part:
    """A part of which this is known."""
    places = {name: tuple(each) for name, each in facts["places"].items()}
    return Part(places, facts["sizes"], "", key, str(library))


def toolchain() -> tuple[str, ...]:
    """What compiles parts, and how."""
    return (compiler.compiler_version(), compiler.host_target(), compiler.cpu_level(), *compiler.FLAGS)


@lru_cache(maxsize=1)
def parts_key() -> str:
    """Digest of all that decides what parts are like: sources, symbolic library, compiler."""
    sources = [f.read_bytes() for f in sorted(FOLDER.glob("*.py"))]
    return cache.digest(sources_key(), *sources, compiler.version_of("casadi"), *toolchain())


def compiled_machine() -> Path:
    """The library of what walks along tapes, compiled once a machine."""
    name = f"machine{compiler.library_suffix()}"

    def make(folder: Path) -> None:
        (folder / "tr_abi.h").write_text(header())
        compiler.build_library(MACHINE[:-1], folder / name, [folder, FOLDER], cache.cache_folder())

    return cache.entry(f"machine-{cache.digest(*(f.read_text() for f in MACHINE), header(), *toolchain())}", make)[0] / name


def _facts() -> Path:
    """Folder of what is known of parts, a file each; what is written by other sources has another."""
    return cache.entry(f"known-{parts_key()}", lambda _: None)[0]


def _known(key: str) -> Part | None:
    """A part that this machine has compiled."""
    try:
        known = json.loads((_facts() / f"{key}.json").read_text())
    except (OSError, ValueError):
        return None
    folder = cache.cache_folder() / known["library"]
    if not (folder / "complete").exists():
        return None
    with suppress(OSError):
        os.utime(folder)  # it is pruned when it is the one unused for longest
    return _told(known, key, _in(folder))


def _keep(part: Part, library: Path) -> None:
    """Write down what is known of a part that was compiled. A file appears whole or not at all."""
    if not part.key:
        return
    own = _facts() / f".{part.key}-{os.getpid()}"
    with suppress(OSError):
        own.write_text(json.dumps(facts(part) | {"library": library.parent.name}))
        own.replace(_facts() / f"{part.key}.json")


def _in(folder: Path) -> Path:
    """The library of a part in the folder of its entry."""
    return folder / f"part{compiler.library_suffix()}"


@cache_of
def _loaded(library: str) -> ctypes.CDLL:
    return ctypes.CDLL(library)


def _compiled(text: str) -> Path:
    """The library of a part, by its text: compiled once a machine."""
    from engine.kernel.emit import MATH

    def make(folder: Path) -> None:
        (folder / "part.c").write_text(MATH + text)
        compiler.build_library([folder / "part.c"], _in(folder), [folder], cache.cache_folder(), flags)

    flags = compiler.part_flags(text)
    return _in(cache.entry(f"part-{cache.digest(MATH, text, *flags, *toolchain())}", make)[0])


def _gone(libraries: set[str]) -> set[str]:
    """Which libraries are no longer where they were when their parts were met: what is unused for long is pruned."""
    out = set()
    for library in libraries - {"", str(built.path("parts"))}:
        with suppress(OSError):
            os.utime(Path(library).parent)
        if not Path(library).exists():
            out.add(library)
    return out


def libraries(parts: Sequence[Part]) -> list[ctypes.CDLL]:
    """Libraries of parts; those that this machine has not yet, or no longer, are compiled side by side, and then known."""
    gone = _gone({p.library for p in parts})
    new = [i for i, p in enumerate(parts) if not p.library or p.library in gone]
    texts = {i: parts[i].text or written(*parts[i].made[:2], *parts[i].made[2]).text for i in new}
    with held() as interrupt, interrupt.open(), side_by_side(2) as submit:
        jobs = {text: submit(_compiled, text) for text in set(texts.values())}
        made = {text: Path(awaited(job)) for text, job in jobs.items()}
    for i in new:
        _keep(parts[i], made[texts[i]])
    return [_loaded(str(made[texts[i]]) if i in texts else p.library) for i, p in enumerate(parts)]
