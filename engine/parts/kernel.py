"""A scene's kernel made of parts: nothing is compiled but the parts themselves, once a machine."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine.abi.header import number
from engine.abi.kernels import ELEMENT, KERNEL, OUTPUTS, PACE, PAIR, POST
from engine.kernel import cache
from engine.kernel.columns import Column
from engine.kernel.library import Kernel, kernel_key
from engine.kernel.records import GIVING, coordinate_kinds, element_table, post_of, row_kinds, wants_of
from engine.parts import derived, functions
from engine.parts.functions import write_contacts, write_shares
from engine.parts.maps import Maps
from engine.parts.memory import table
from engine.parts.probing import Probe
from engine.parts.recursive import Recursive
from engine.parts.rows import Rows
from engine.parts.scene import Scene
from engine.parts.stepping import Stepping
from engine.parts.unit import Derived, Unit
from engine.system.coupling import MANY_ROWS, fill, tables_of
from engine.system.loops import rows_of, rubbing_on_loops, rubs
from engine.system.pace import frequencies
from engine.system.structure import System

FUNCTIONS = ("prepare", "stage1", "stage2", "laws", "laws_alone", "held", "held_alone", "pressed", "closure", "events", "qdot",
             "energy")  # fmt: skip
RECURSIVE = ("begin", "narrow", "respond", "answer", "derive")
"""Of trees with friction, too; and of many loops that rub:"""
COUPLING = ("shift",)


@dataclass
class PartsKernel(Kernel):
    """A kernel whose tables are in memory, as the runtime reads them, with what keeps them there."""

    units: dict[str, Unit]
    tables: dict[str, Any]
    keep: list[Any]

    def jacobian(self) -> int:
        system, _, _, redundant = self.structure
        return self._made("jacobian", lambda: derived.jacobian_unit(system, self.facts["active_rows"], redundant))

    def linear(self, chosen: list[Column]) -> int:
        return self._made("linear", lambda: derived.linear_unit(self.structure[0], self.facts["active_rows"], chosen))

    def _made(self, name: str, make: Callable[[], Unit]) -> int:
        """Address of a unit that is made when it is first asked for."""
        if name not in self.units:
            self.units[name] = make()
            self.tables[name] = table(self.units[name], self.keep)
        return self.address(name)

    def address(self, unit: str) -> int:
        return ctypes.addressof(self.tables[unit]) if unit in self.tables else super().address(unit)


SOLVED = {"acceleration", "qdd", "reaction", "drive", "tie", "power", "friction", "contact"}
"""First words of the keys of columns that depend on multipliers or accelerations."""


def parts_kernel(
    system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool = False
) -> PartsKernel:
    """A scene's kernel, its tables made for it and these columns. redundant: the variant with the scaled reactions."""
    started = time.perf_counter()
    keep: list[Any] = []
    active, coupled = _structure(system, parameters) if system.cuts else ([], False)
    rows = list(range(system.rows)) if redundant else active
    kernel, _ = _kernel_unit(system, parameters, rows, redundant, not redundant and len(rows) >= MANY_ROWS)
    kernel.numbers["coupled"] = int(coupled)
    outputs = _outputs_unit(system, chosen, quadratures)
    sizes = kernel.numbers | {"works": kernel.numbers["npowers"] * quadratures}
    facts = {"operations": {}, "active_rows": rows, "loop_rows": rows_of(system), "rubbing": [j.name for j in system.frictional]}
    key = kernel_key(system, parameters, chosen, quadratures, redundant)
    structure, units = (system, parameters, quadratures, redundant), {"kernel": kernel, "outputs": outputs}
    tables = {name: table(unit, keep) for name, unit in units.items()}
    return PartsKernel({}, sizes, facts, time.perf_counter() - started, cache.cache_folder(), key, structure, units, tables, keep)


def _structure(system: System, parameters: int) -> tuple[list[int], bool]:
    """Rows of cut joints that are not empty by structure, and whether the multipliers of the others are pulled along by theirs."""
    keep: list[Any] = []
    rubbing = rubs(system)
    unit, maps = _kernel_unit(system, parameters, list(range(system.rows)), rubbing)
    made = table(unit, keep)

    def call(name: str, *arrays: np.ndarray) -> None:
        places = [*([made.scene] if name == "prepare" else []), *(a.ctypes.data for a in arrays)]
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(places))(getattr(made, name))(*places)

    probe = Probe(system, made, maps, call)
    active = probe.active()
    return active, rubbing and probe.coupled(active)


def _kernel_unit(
    system: System, parameters: int, active: Sequence[int], redundant: bool, many: bool = False
) -> tuple[Unit, Maps]:
    """many: loops are so many that their friction is found along the recursion, as that of trees is."""
    rubbed = bool(system.frictional) and (many or not system.cuts)
    s = Scene(system, rubbed=rubbed)
    redundant = redundant and bool(system.frictional)
    stepping = Stepping(s, active, redundant)
    if rubbed:
        Recursive(stepping)
    functions.write(s, redundant)
    qkind, vkind, quat = coordinate_kinds(system)
    turned = {e.joint.name: (at, n) for e, at, n in (rubbing_on_loops(system) if redundant else [])}
    more = [(n, n * len(e.needs)) for e in stepping.parts for _, n in [turned.get(e.joint.name, (0, 0))]]
    elements, sliders, dn = element_table(stepping.parts, turned)
    paces, filled = frequencies(system), fill(system, active)
    each = len(system.frictional) + 3
    m = stepping.maps
    sizes = dict.fromkeys(KERNEL.integers, 0) | {
        "npowers": each, "ntaken": each - GIVING, "abi": number(), "nq": system.nq, "nv": system.nv,
        "nb": len(system.bristles), "nx": system.external.size, "np": parameters,
        "nc": s.nc, "nw": stepping.nw, "nmaps": m.at("end") + 1, "rows": system.rows, "active": len(active), "nkappa": m.nkappa,
        "nmore": sum(n for n, _ in more), "ndmore": sum(n for _, n in more), "loop_friction": int(rubs(system)),
        "neta": system.neta, "nn": m.nn, "nrates": m.nrates,
        "nsliders": len(system.sliders), "nstops": system.stops, "nlatches": system.latches,
        "ntables": system.tables, "nquat": len(quat),
        "nelements": len(elements), "npaces": len(paces), "nbodies": len(system.bodies), "ndn": dn,
        "sets": int(any(e.sets for e in stepping.parts)), "nfill": len(filled.below),
    }  # fmt: skip
    names = [*FUNCTIONS, *(RECURSIVE if rubbed else ()), *(COUPLING if rubbed and system.cuts else ())]
    integers = {"active_rows": active, "row_kind": row_kinds(system), "qkind": qkind, "vkind": vkind, "quat": quat}
    integers |= {"down": system.down, "presses": system.presses}
    integers |= tables_of(filled)
    rows = {"element": (ELEMENT, elements), "pair": (PAIR, sliders), "pace": (PACE, paces)}
    return Unit(KERNEL, Derived(s), sizes, {n: n for n in names}, integers, rows), m


def _outputs_unit(system: System, chosen: list[Column], quadratures: bool) -> Unit:
    s = Scene(system)
    Rows(s, s.tape("eval")).write(chosen)
    contacts, shares, post = write_contacts(s), write_shares(s), post_of(chosen)
    energy = next((i for i, c in enumerate(chosen) if c.name == "energy.residual"), -1)
    names = ["prepare", "eval", *(["contacts"] if contacts else []), *(["kappa"] if shares else [])]
    numbers = {
        "abi": number(), "nout": len(chosen), "ncontacts": contacts, "nc": s.nc, "nkappa": shares, "npost": len(post),
        "energy": energy, "works": int(quadratures), "wants": wants_of(chosen, any(c.key[0] in SOLVED for c in chosen)),
    }  # fmt: skip
    return Unit(OUTPUTS, Derived(s), numbers, {n: n for n in names}, records={"post": (POST, post)})
