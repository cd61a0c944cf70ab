"""Precompiled primitives of the bytecode. A primitive is taken from the installation or from this machine's cache, or is built when
it is needed. Its key is the digest of its recipe: module, function and arguments that build it. A primitive is derived symbolically
and compiled only if it is neither installed nor cached."""

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

from trunnion.basics.interrupts import held
from trunnion.kernel.compilation import c_compiler, library_cache, prebuilt_libraries
from trunnion.kernel.compilation.compiler_processes import awaited, side_by_side
from trunnion.kernel.shared_libraries import sources_key
from trunnion.parts.primitives.primitive_keys import Primitive, library_name
from trunnion.runtime.abi.c_header import header

FOLDER = Path(__file__).parents[1]
BYTECODE = FOLDER / "bytecode"
INTERPRETER = [
    BYTECODE / name for name in ("interpreter.c", "interpreter_tangent.c", "ops_loop_factor.c", "ops_curve_foot.c", "interpreter.h")
]


class _LazyModule:
    """Stands for a module of primitives. A function of the module runs, and imports the symbolic library, only to build a primitive
    that is neither installed nor cached."""

    def __init__(self, module: str):
        self._module = module

    def __getattr__(self, name: str) -> Callable[..., Primitive]:
        lookup = cache_of(partial(primitive, self._module, name))
        setattr(self, name, lookup)
        return lookup


if TYPE_CHECKING:
    from trunnion.parts.primitives import (
        body_step,
        column_primitives,
        force_laws,
        friction,
        inverse_dynamics,
        joint_devices,
        loop_joints_and_reactions,
        primitive_derivatives,
        signals_loads_energies,
    )
else:
    inverse_dynamics, body_step, column_primitives = map(_LazyModule, ("inverse_dynamics", "body_step", "column_primitives"))
    friction, joint_devices, signals_loads_energies = map(_LazyModule, ("friction", "joint_devices", "signals_loads_energies"))
    force_laws, primitive_derivatives = map(_LazyModule, ("force_laws", "primitive_derivatives"))
    loop_joints_and_reactions = _LazyModule("loop_joints_and_reactions")


def primitive(module: str, name: str, *arguments: Hashable) -> Primitive:
    """The primitive that a function of a primitives module builds from these arguments."""
    recipe = (module, name, *arguments)
    key = key_of(*recipe)
    found = _installed(recipe, key) or _cached(key) or replace(build_primitive(module, name, *arguments), key=key)
    return replace(found, recipe=recipe)


def key_of(*recipe: Hashable) -> str:
    """Digest of a recipe (module, function, arguments)."""
    return library_cache.digest(repr(recipe))


def build_primitive(module: str, name: str, *arguments: Hashable) -> Primitive:
    """Build the primitive symbolically. Raises SceneError if the packages that write and compile C are not installed."""
    c_compiler.needed("this scene", f"a part that did not come with the installation ({module}.{name})")
    from trunnion.recursion.fast_casadi_arithmetic import direct_operators

    with direct_operators():
        built: Primitive = getattr(import_module(f"trunnion.parts.primitives.{module}"), name)(*arguments)
    return built


_unpacked = cache_of(prebuilt_libraries.unpacked)


def _installed(recipe: tuple[Hashable, ...], key: str) -> Primitive | None:
    """An installed primitive, or None. The facts of a primitive are in the same library."""
    library = _unpacked(library_name(recipe))
    if library is None:
        return None
    try:
        text = ctypes.cast(getattr(_load(str(library)), facts_symbol(key)), ctypes.c_char_p).value
    except AttributeError:
        return None
    return _from_facts(json.loads(text or b""), key, library)


def facts_symbol(key: str) -> str:
    """C name of a primitive's facts in a library with many primitives."""
    return f"tr_part_{key}"


def facts_of(primitive: Primitive) -> dict[str, Any]:
    """Operands and sizes of a primitive, as JSON data. Programs need these facts to call the primitive."""
    return {"operands": primitive.operands, "sizes": primitive.sizes}


def _from_facts(facts: dict[str, Any], key: str, library: Path) -> Primitive:
    operands = {name: tuple(each) for name, each in facts["operands"].items()}
    return Primitive(operands, facts["sizes"], "", key, str(library))


@lru_cache(maxsize=1)
def primitives_key() -> str:
    """Digest of all that determines the machine code of primitives: ``texts_key`` and the compiler."""
    return library_cache.digest(texts_key(), *c_compiler.toolchain())


@lru_cache(maxsize=1)
def texts_key() -> str:
    """Digest of all that determines the C text of primitives: sources and symbolic library."""
    sources = library_cache.digest_of_files(FOLDER, ["."], (".py",))
    return library_cache.digest(sources_key(), sources, c_compiler.version_of("casadi"))


def compiled_interpreter(machine: c_compiler.Machine | None = None) -> Path:
    """The library of the interpreter for a machine, by default this machine. The library is compiled once."""
    name = f"interpreter{machine.suffix if machine else c_compiler.library_suffix()}"
    key = library_cache.digest(*(f.read_text() for f in INTERPRETER), header(), *c_compiler.toolchain(machine))

    def make(folder: Path) -> None:
        (folder / "tr_abi.h").write_text(header())
        include, cache = [folder, BYTECODE], library_cache.cache_folder()
        c_compiler.build_library(INTERPRETER[:-1], folder / name, include, cache, machine=machine)

    return library_cache.entry(f"interpreter-{key}", make)[0] / name


def _facts_folder() -> Path:
    """Folder of facts, with one file for each primitive that the present sources have built. Fast builds have a separate folder."""
    return library_cache.entry(f"known-{primitives_key()}{'-quick' * c_compiler.quick()}", lambda _: None)[0]


def _cached(key: str) -> Primitive | None:
    """A primitive that this machine has compiled, or None."""
    try:
        facts = json.loads((_facts_folder() / f"{key}.json").read_text())
    except (OSError, ValueError):
        return None
    folder = library_cache.cache_folder() / facts["library"]
    if not (folder / "complete").exists():
        return None
    with suppress(OSError):
        os.utime(folder)  # marks the entry as recently used, so that pruning keeps it
    return _from_facts(facts, key, _library_in(folder))


def _store_facts(primitive: Primitive, library: Path) -> None:
    """Store the facts of a compiled primitive atomically in a file."""
    if not primitive.key:
        return
    temporary = _facts_folder() / f".{primitive.key}-{os.getpid()}"
    with suppress(OSError):
        temporary.write_text(json.dumps(facts_of(primitive) | {"library": library.parent.name}))
        temporary.replace(_facts_folder() / f"{primitive.key}.json")


def _library_in(folder: Path) -> Path:
    return folder / f"part{c_compiler.library_suffix()}"


@cache_of
def _load(library: str) -> ctypes.CDLL:
    return ctypes.CDLL(library)


def _compile(flags: tuple[str, ...], text: str) -> Path:
    """The library of primitives with this C text, which a machine compiles once."""
    from trunnion.kernel.c_code.code_generator import MATH

    def make(folder: Path) -> None:
        (folder / "part.c").write_text(MATH + text)
        c_compiler.build_library([folder / "part.c"], _library_in(folder), [folder], library_cache.cache_folder(), flags)

    return _library_in(library_cache.entry(f"part-{library_cache.digest(MATH, text, *flags, *c_compiler.toolchain())}", make)[0])


def _is_there(library: str) -> bool:
    """Whether a library is still in the cache. (Pruning removes the least recently used entries.)"""
    with suppress(OSError):
        os.utime(Path(library).parent)
    return Path(library).exists()


def _groups(texts: set[str]) -> list[tuple[tuple[str, ...], list[str]]]:
    """Pairs of compiler flags and the C texts that become one library with these flags. Long texts are divided between two compiler
    processes."""
    out: dict[tuple[tuple[str, ...], int], list[str]] = {}
    compilers = 2 if sum(map(len, texts)) > c_compiler.LONG_PART else 1
    for number, text in enumerate(sorted(texts, key=lambda t: (len(t), t))):
        flags = c_compiler.QUICK if c_compiler.quick() else c_compiler.part_flags(text)
        out.setdefault((flags, number % compilers), []).append(text)
    return [(flags, group) for (flags, _), group in out.items()]


def libraries(primitives: Sequence[Primitive]) -> list[ctypes.CDLL]:
    """The libraries of primitives. Missing primitives are compiled in parallel and cached. Primitives with the same flags share a
    library, because starting compiler and linker takes as long as compiling several small primitives."""
    there = {library: _is_there(library) for library in {p.library for p in primitives} - {""}}
    found = [p.library if there.get(p.library) else _found_again(p) for p in primitives]
    new = [i for i, library in enumerate(found) if not library]
    if not new:
        return [_load(library) for library in found]
    texts = {i: primitives[i].text or build_primitive(*primitives[i].recipe).text for i in new}
    with held() as interrupt, interrupt.open(), side_by_side(2) as submit:
        jobs = [(group, submit(_compile, flags, "".join(group))) for flags, group in _groups(set(texts.values()))]
        compiled = {text: awaited(job) for group, job in jobs for text in group}
    for i in new:
        _store_facts(primitives[i], compiled[texts[i]])
        found[i] = str(compiled[texts[i]])
    return [_load(library) for library in found]


def _found_again(p: Primitive) -> str:
    """The library of a primitive that was pruned, or was compiled after this process looked for it. The library is unpacked again
    from the installation, or taken from the cache; "" if neither has the library."""
    again = prebuilt_libraries.unpacked(library_name(p.recipe))
    if again and str(again) == p.library:
        return p.library
    known = _cached(p.key) if p.key else None
    return known.library if known else ""
