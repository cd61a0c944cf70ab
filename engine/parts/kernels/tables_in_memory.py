"""Tables of a bytecode kernel in memory."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from trunnion.kernel.compilation import prebuilt_libraries
from trunnion.parts.bytecode.program import BUILTINS
from trunnion.parts.kernels.table_contents import DifferentiatedScene, UnitDescription
from trunnion.parts.layout.scene_tables import SceneTables
from trunnion.parts.primitives.primitive_cache import compiled_interpreter, libraries
from trunnion.runtime.abi.kernel_records import DIRECTIONS, SCENE


@lru_cache(maxsize=1)
def interpreter() -> ctypes.CDLL:
    """The library of the interpreter. If this library is not installed, this machine compiles it once."""
    return prebuilt_libraries.library("interpreter") or ctypes.CDLL(str(compiled_interpreter()))


def _addresses(s: SceneTables) -> Any:
    """Addresses of all ops, by number: first builtin ops, then primitives."""
    own = (ctypes.c_void_p * BUILTINS).in_dll(interpreter(), "tr_builtin_ops")
    used = {primitive.first: primitive for primitive in s.primitive_of.values()}
    found_in = dict(zip(used, libraries(list(used.values())), strict=True))
    libraries_of = {n: found_in[s.primitive_of[n].first] if n in s.primitive_of else interpreter() for n in s.functions}
    found = [ctypes.cast(getattr(library, n), ctypes.c_void_p).value for n, library in libraries_of.items()]
    return (ctypes.c_void_p * (BUILTINS + len(found)))(*own, *found)


def table(unit: UnitDescription, keep: list[Any]) -> Any:
    """The record of a unit. keep receives the arrays to which the record points."""
    functions = {field: _address(f"tr_parts_{name}") for field, name in unit.functions.items()}
    made = unit.record.ctype(**unit.numbers, scene=ctypes.addressof(_scene(unit.scene, keep)), **functions)
    for name, values in unit.integers.items():
        setattr(made, name, _integers(values, keep))
    for name, (record, rows) in unit.records.items():
        written = (record.ctype * (len(rows) + 1))(*rows)
        keep.append(written)
        setattr(made, name, ctypes.addressof(written))
    return made


def _address(name: str) -> int:
    return ctypes.cast(getattr(interpreter(), name), ctypes.c_void_p).value or 0


def _integers(values: Sequence[int], keep: list[Any]) -> int:
    """Address of an array with these integers and a final zero."""
    array = np.array([*values, 0], np.intc)
    keep.append(array)
    address: int = array.ctypes.data
    return address


def _scene(of: DifferentiatedScene, keep: list[Any]) -> Any:
    s, constants, ops = of.scene, np.array([*of.scene.constants, 0.0]), _addresses(of.scene)
    made = SCENE.ctype(nc=s.nc, constants=constants.ctypes.data, op=ctypes.addressof(ops))
    for name, program in s.programs.items():
        code = np.array(program.merged(), np.intc)
        allocate = getattr(made, name)
        allocate.length, allocate.scratch, allocate.code = len(code), program.scratch, code.ctypes.data
        keep.append(code)
    if of.tangents:
        arrays = {name: _integers(values, keep) for name, values in of.tangents.tables.items()}
        directions = DIRECTIONS.ctype(**of.tangents.sizes, **arrays)
        made.directions = ctypes.addressof(directions)
        keep.append(directions)
    if of.beside:
        made.beside = ctypes.addressof(_scene(of.beside, keep))
    keep += [constants, ops, made]
    return made


def scene_at(of: DifferentiatedScene, keep: list[Any]) -> int:
    """Address of the record of a scene."""
    return ctypes.addressof(_scene(of, keep))
