"""A scene's kernel made of parts: nothing is compiled but the parts themselves, once a machine."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache as cache_of
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from engine.abi.header import header, number
from engine.abi.kernels import ELEMENT, KERNEL, OUTPUTS, PACE, PAIR, POST, SCENE
from engine.abi.records import Record
from engine.basics.interrupts import held
from engine.kernel import cache, compiler
from engine.kernel.columns import Column
from engine.kernel.emit import MATH
from engine.kernel.library import Kernel, kernel_key
from engine.kernel.output_unit import post_of, wants_of
from engine.kernel.powers import GIVING
from engine.kernel.programs import awaited, side_by_side
from engine.kernel.source import coordinate_kinds, element_table, row_kinds
from engine.parts import functions
from engine.parts.functions import write_contacts, write_shares
from engine.parts.maps import Maps
from engine.parts.probing import Probe
from engine.parts.recursive import Recursive
from engine.parts.rows import Rows
from engine.parts.scene import Scene
from engine.parts.stepping import Stepping
from engine.parts.tape import BUILTINS
from engine.recursion.direct import direct_operators
from engine.recursion.elements import Element
from engine.recursion.redundancy import rows_of, rubbing_on_loops, rubs
from engine.system.coupling import fill, tables_of
from engine.system.pace import frequencies
from engine.system.structure import System

MACHINE = Path(__file__).with_name("machine.c")
FUNCTIONS = ("prepare", "stage1", "stage2", "laws", "laws_alone", "held", "held_alone", "pressed", "closure", "events", "qdot",
             "energy")  # fmt: skip
RECURSIVE = ("begin", "narrow", "respond", "answer", "derive")
"""Of trees with friction, too."""


@dataclass
class PartsKernel(Kernel):
    """A kernel whose tables are in memory, as the runtime reads them, with what keeps them there. Its Jacobian unit is compiled for
    the scene, when a method asks for it."""

    tables: dict[str, Any]
    keep: list[Any]

    def address(self, unit: str) -> int:
        return ctypes.addressof(self.tables[unit]) if unit in self.tables else super().address(unit)


@lru_cache(maxsize=1)
def machine() -> ctypes.CDLL:
    """What walks along tapes, compiled once a machine."""
    suffix = compiler.library_suffix()

    def make(folder: Path) -> None:
        (folder / "tr_abi.h").write_text(header())
        compiler.build_library([MACHINE], folder / f"machine{suffix}", [folder], cache.cache_folder())

    folder, _ = cache.entry(f"machine-{_digest(MACHINE.read_text(), header())}", make)
    return ctypes.CDLL(str(folder / f"machine{suffix}"))


@cache_of
def compiled(text: str) -> ctypes.CDLL:
    """The library of a part, by its text: compiled once a machine."""
    suffix = compiler.library_suffix()

    def make(folder: Path) -> None:
        (folder / "part.c").write_text(MATH + text)
        compiler.build_library([folder / "part.c"], folder / f"part{suffix}", [folder], cache.cache_folder())

    folder, _ = cache.entry(_entry(text), make)
    return ctypes.CDLL(str(folder / f"part{suffix}"))


def _entry(text: str) -> str:
    return f"part-{_digest(MATH, text)}"


def _digest(*texts: str) -> str:
    """Digest of C texts and of what compiles them."""
    toolchain = (compiler.compiler_version(), compiler.host_target(), compiler.cpu_level(), *compiler.FLAGS)
    return cache.digest(*texts, *toolchain)


def _compiled(texts: list[str]) -> list[ctypes.CDLL]:
    """Libraries of parts; those that this machine has not yet are compiled side by side."""
    missing = [t for t in texts if not (cache.cache_folder() / _entry(t)).exists()]
    with held() as interrupt, interrupt.open(), side_by_side(2) as submit:
        for job in [submit(compiled, t) for t in missing]:
            awaited(job)
    return [compiled(t) for t in texts]


def _addresses(s: Scene) -> Any:
    """The functions that tapes call, in the order of their numbers: the machine's own, then those of the parts."""
    own = (ctypes.c_void_p * BUILTINS).in_dll(machine(), "tr_machine_parts")
    libraries = dict(zip(s.texts, _compiled(list(s.texts.values())), strict=True))
    found = [ctypes.cast(getattr(libraries[s.texts_of[n]], n), ctypes.c_void_p).value for n in s.functions]
    return (ctypes.c_void_p * (BUILTINS + len(found)))(*own, *found)


def _scene_table(s: Scene, keep: list[Any]) -> Any:
    constants = np.array([*s.constants, 0.0])
    parts = _addresses(s)
    table = SCENE.ctype(constants=constants.ctypes.data, part=ctypes.addressof(parts))
    for name, tape in s.tapes.items():
        code = tape.array()
        place = getattr(table, name)
        place.length, place.scratch, place.code = len(code), tape.scratch, code.ctypes.data
        keep.append(code)
    keep += [constants, parts, table]
    return table


@dataclass
class _Told:
    """What ``element_table`` reads of a compiled unit."""

    elements: list[Element]
    turned: dict[str, tuple[int, int]]


SOLVED = {"acceleration", "qdd", "reaction", "drive", "friction", "contact"}
"""First words of the keys of columns that depend on multipliers or accelerations."""


def parts_kernel(
    system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool = False
) -> PartsKernel:
    """A scene's kernel, its tables made for it and these columns. redundant: the variant with the scaled reactions."""
    started = time.perf_counter()
    keep: list[Any] = []
    with direct_operators():
        active, coupled = _structure(system, parameters) if system.cuts else ([], False)
        rows = list(range(system.rows)) if redundant else active
        table, sizes, _ = _kernel_table(system, parameters, rows, redundant, keep)
        table.coupled = sizes["coupled"] = int(coupled)
        sizes["works"] = table.npowers * quadratures
        outputs = _outputs_table(system, chosen, quadratures, keep)
    facts = {"operations": {}, "active_rows": rows, "loop_rows": rows_of(system), "rubbing": [j.name for j in system.frictional]}
    key = kernel_key(system, parameters, chosen, quadratures, redundant)
    structure, tables = (system, parameters, quadratures, redundant), {"kernel": table, "outputs": outputs}
    return PartsKernel({}, sizes, facts, time.perf_counter() - started, cache.cache_folder(), key, structure, tables, keep)


def _structure(system: System, parameters: int) -> tuple[list[int], bool]:
    """Rows of cut joints that are not empty by structure, and whether the multipliers of the others are pulled along by theirs."""
    keep: list[Any] = []
    rubbing = rubs(system)
    table, _, maps = _kernel_table(system, parameters, list(range(system.rows)), rubbing, keep)

    def call(name: str, *arrays: np.ndarray) -> None:
        places = [*([table.scene] if name == "prepare" else []), *(a.ctypes.data for a in arrays)]
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(places))(getattr(table, name))(*places)

    probe = Probe(system, table, maps, call)
    active = probe.active()
    return active, rubbing and probe.coupled(active)


def _kernel_table(
    system: System, parameters: int, active: Sequence[int], redundant: bool, keep: list[Any]
) -> tuple[Any, dict[str, int], Maps]:
    rubbed = bool(system.frictional) and not system.cuts
    s = Scene(system, rubbed=rubbed)
    redundant = redundant and bool(system.frictional)
    stepping = Stepping(s, active, redundant)
    if rubbed:
        Recursive(stepping)
    functions.write(s, redundant)
    scene = _scene_table(s, keep)
    qkind, vkind, quat = coordinate_kinds(system)
    turned = {e.joint.name: (at, n) for e, at, n in (rubbing_on_loops(system) if redundant else [])}
    more = [(n, n * len(e.needs)) for e in stepping.parts for _, n in [turned.get(e.joint.name, (0, 0))]]
    elements, sliders, dn = element_table(_Told(stepping.parts, turned))  # type: ignore[arg-type]
    paces, filled = frequencies(system), fill(system, active)
    each = len(system.frictional) + 3
    m = stepping.maps
    sizes = dict.fromkeys(KERNEL.integers, 0) | {
        "npowers": each, "ntaken": each - GIVING, "abi": number(), "nq": system.nq, "nv": system.nv,
        "nb": len(system.bristles), "nx": system.external.size, "np": parameters,
        "nc": s.nc, "nw": stepping.nw, "nmaps": m.at("end") + 1, "rows": system.rows, "active": len(active), "nkappa": m.nkappa,
        "nmore": sum(n for n, _ in more), "ndmore": sum(n for _, n in more), "loop_friction": int(rubs(system)),
        "neta": system.neta, "nn": m.nn, "nrates": m.nrates,
        "nsliders": len(system.sliders), "nstops": system.stops, "ntables": system.tables, "nquat": len(quat),
        "nelements": len(elements), "npaces": len(paces), "nbodies": len(system.bodies), "ndn": dn,
        "sets": int(any(e.sets for e in stepping.parts)), "nfill": len(filled.below),
    }  # fmt: skip
    names = [*FUNCTIONS, *(RECURSIVE if rubbed else ())]
    table = KERNEL.ctype(**sizes, scene=ctypes.addressof(scene), **_functions(names))
    tables = {"active_rows": active, "row_kind": row_kinds(system), "qkind": qkind, "vkind": vkind, "quat": quat}
    tables |= tables_of(filled)
    for name, values in tables.items():
        array = np.array([*values, 0], np.intc)
        keep.append(array)
        setattr(table, name, array.ctypes.data)
    for name, record, rows in (("element", ELEMENT, elements), ("pair", PAIR, sliders), ("pace", PACE, paces)):
        setattr(table, name, _records(record, rows, keep))
    return table, sizes, m


def _outputs_table(system: System, chosen: list[Column], quadratures: bool, keep: list[Any]) -> Any:
    s = Scene(system)
    Rows(s, s.tape("eval")).write(chosen)
    contacts, shares = write_contacts(s), write_shares(s)
    scene = _scene_table(s, keep)
    post = post_of(chosen)
    energy = next((i for i, c in enumerate(chosen) if c.name == "energy.residual"), -1)
    names = ["prepare", "eval", *(["contacts"] if contacts else []), *(["kappa"] if shares else [])]
    return OUTPUTS.ctype(
        abi=number(), nout=len(chosen), ncontacts=contacts, nc=s.nc, nkappa=shares, npost=len(post), energy=energy,
        works=int(quadratures), wants=wants_of(chosen, any(c.key[0] in SOLVED for c in chosen)), post=_records(POST, post, keep),
        scene=ctypes.addressof(scene), **_functions(names),
    )  # fmt: skip


def _functions(names: Iterable[str]) -> dict[str, int | None]:
    """Addresses of the machine's functions of a table."""
    return {n: ctypes.cast(getattr(machine(), f"tr_parts_{n}"), ctypes.c_void_p).value for n in names}


def _records(record: Record, rows: Sequence[tuple[Any, ...]], keep: list[Any]) -> int:
    """Address of a table of records."""
    made = (record.ctype * (len(rows) + 1))(*rows)
    keep.append(made)
    return ctypes.addressof(made)
