"""Tables of scenes in memory, as the machine reads them."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from engine.abi.kernels import DIRECTIONS, SCENE
from engine.kernel import built
from engine.parts.store import compiled_machine, libraries
from engine.parts.tables import Tables
from engine.parts.tape import BUILTINS
from engine.parts.unit import Derived, Unit


@lru_cache(maxsize=1)
def machine() -> ctypes.CDLL:
    """What walks along tapes: the installation's, else compiled once a machine."""
    found = built.library("machine")
    if found:
        return found
    return ctypes.CDLL(str(compiled_machine()))


def _addresses(s: Tables) -> Any:
    """The functions that tapes call, in the order of their numbers: the machine's own, then those of the parts."""
    own = (ctypes.c_void_p * BUILTINS).in_dll(machine(), "tr_machine_parts")
    used = {part.first: part for part in s.part_of.values()}
    found_in = dict(zip(used, libraries(list(used.values())), strict=True))
    libraries_of = {n: found_in[s.part_of[n].first] if n in s.part_of else machine() for n in s.functions}
    found = [ctypes.cast(getattr(library, n), ctypes.c_void_p).value for n, library in libraries_of.items()]
    return (ctypes.c_void_p * (BUILTINS + len(found)))(*own, *found)


def table(unit: Unit, keep: list[Any]) -> Any:
    """The record of a unit. keep: what is to last as long."""
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
    return ctypes.cast(getattr(machine(), name), ctypes.c_void_p).value or 0


def _integers(values: Sequence[int], keep: list[Any]) -> int:
    """Address of integers, and one behind them."""
    array = np.array([*values, 0], np.intc)
    keep.append(array)
    address: int = array.ctypes.data
    return address


def _scene(of: Derived, keep: list[Any]) -> Any:
    s, constants, parts = of.scene, np.array([*of.scene.constants, 0.0]), _addresses(of.scene)
    made = SCENE.ctype(nc=s.nc, constants=constants.ctypes.data, part=ctypes.addressof(parts))
    for name, tape in s.tapes.items():
        code = tape.array()
        place = getattr(made, name)
        place.length, place.scratch, place.code = len(code), tape.scratch, code.ctypes.data
        keep.append(code)
    if of.found:
        arrays = {name: _integers(values, keep) for name, values in of.found.tables.items()}
        directions = DIRECTIONS.ctype(**of.found.sizes, **arrays)
        made.directions = ctypes.addressof(directions)
        keep.append(directions)
    if of.beside:
        made.beside = ctypes.addressof(_scene(of.beside, keep))
    keep += [constants, parts, made]
    return made


def scene_at(of: Derived, keep: list[Any]) -> int:
    """Address of a scene."""
    return ctypes.addressof(_scene(of, keep))
