"""A bytecode kernel: programs and tables of one scene, in memory. Only missing primitives are compiled."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.columns.registry import REGISTRY
from trunnion.kernel.compilation import library_cache
from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.interface.runtime_tables import (
    GIVING,
    coordinate_kinds,
    element_table,
    post_of,
    row_kinds,
    unilateral_table,
    wants_of,
)
from trunnion.kernel.shared_libraries import Kernel
from trunnion.parts.kernels.table_contents import DifferentiatedScene, UnitDescription
from trunnion.parts.kernels.tables_in_memory import table
from trunnion.parts.layout.multiplier_maps_layout import Maps
from trunnion.parts.programs import kernel_functions
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.parts.programs.column_programs import ColumnPrograms
from trunnion.parts.programs.evaluation_stages import EvaluationPrograms
from trunnion.parts.programs.kernel_functions import write_contacts, write_shares
from trunnion.parts.programs.recursive_friction import RecursiveFriction
from trunnion.parts.programs.structural_zeros import StructureProbe
from trunnion.runtime.abi.c_header import number
from trunnion.runtime.abi.kernel_records import ELEMENT, KERNEL, OUTPUTS, PACE, PAIR, POST, UNILATERAL
from trunnion.system.signals.excitation_frequencies import frequencies
from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.force_curve_positions import curve_positions
from trunnion.system.structure.loop_friction_operation_count import is_recursion_shorter
from trunnion.system.structure.loop_joints import rows_of, rubbing_on_loops, rubs
from trunnion.system.structure.loop_matrix_fill import fill, tables_of
from trunnion.system.structure.redundant_loop_groups import reaction_groups

FUNCTIONS = ("prepare", "stage1", "stage2", "laws", "laws_alone", "held", "held_alone", "pressed", "closure", "events", "qdot",
             "energy")  # fmt: skip
RECURSIVE = ("begin", "narrow", "respond", "answer", "derive")
"""Additional functions of a kernel that solves friction along the recursion."""
COUPLING = ("shift",)
"""Additional function of a kernel that solves friction along the recursion, for a scene with loops."""
RECENT = 4
"""Number of tables that are kept for later kernels. A run may need two kernels; the next run of the mechanism needs the same two
kernels."""


@dataclass
class PartsKernel(Kernel):
    """A kernel whose tables are in memory. keep: the arrays to which the tables point, so that these arrays exist as long as the
    kernel."""

    units: dict[str, UnitDescription]
    tables: dict[str, Any]
    keep: list[Any]

    def jacobian(self) -> int:
        from trunnion.parts.kernels.derivative_units import jacobian_unit  # most runs do not need these modules

        system, _, _, redundant = self.structure
        return self._made("jacobian", lambda: jacobian_unit(system, self.facts["active_rows"], redundant))

    def linear(self, chosen: list[Column]) -> int:
        from trunnion.parts.kernels.derivative_units import linear_unit

        return self._made("linear", lambda: linear_unit(self.structure[0], self.facts["active_rows"], chosen))

    def _made(self, name: str, make: Callable[[], UnitDescription]) -> int:
        """Address of a unit. The first request builds the unit."""
        if name not in self.units:
            self.units[name] = make()
            self.tables[name] = table(self.units[name], self.keep)
        return self.address(name)

    def address(self, unit: str) -> int:
        return ctypes.addressof(self.tables[unit]) if unit in self.tables else super().address(unit)


def parts_kernel(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool = False) -> PartsKernel:
    """The kernel of a scene with these columns. redundant: whether to build the variant with scaled reactions."""
    started = time.perf_counter()
    rows, kernel, evaluation, kept = _evaluation(system, parameters, redundant)
    outputs, columns, also_kept = _outputs(system, tuple(chosen), quadratures)
    sizes = kernel.numbers | {"works": kernel.numbers["npowers"] * quadratures}
    facts = {"operations": {}, "active_rows": rows, "loop_rows": rows_of(system), "rubbing": [j.name for j in system.frictional]}
    structure, units = (system, parameters, quadratures, redundant), {"kernel": kernel, "outputs": outputs}
    tables, keep = {"kernel": evaluation, "outputs": columns}, [*kept, *also_kept]
    return PartsKernel(
        {}, sizes, facts, time.perf_counter() - started, library_cache.cache_folder(), chosen, structure, units, tables, keep
    )


@lru_cache(maxsize=RECENT)
def _evaluation(system: System, parameters: int, redundant: bool) -> tuple[list[int], UnitDescription, Any, list[Any]]:
    """Rows of cut joints with a multiplier, the unit of the kernel, its table, and the arrays to which the table points."""
    keep: list[Any] = []
    active, coupled = _structure(system, parameters) if system.cuts else ([], False)
    rows = list(range(system.rows)) if redundant else active
    loops = bool(system.frictional and rows) and not redundant and not system.light and not system.unilateral
    along = loops and is_recursion_shorter(system, rows)
    unit, _ = _kernel_unit(system, parameters, rows, redundant, along)
    unit.numbers["coupled"] = int(coupled)
    return rows, unit, table(unit, keep), keep


@lru_cache(maxsize=RECENT)
def _outputs(system: System, chosen: tuple[Column, ...], quadratures: bool) -> tuple[UnitDescription, Any, list[Any]]:
    """The unit of the columns, its table, and the arrays to which the table points."""
    keep: list[Any] = []
    unit = _outputs_unit(system, list(chosen), quadratures)
    return unit, table(unit, keep), keep


def _structure(system: System, parameters: int) -> tuple[list[int], bool]:
    """Rows of cut joints that have a multiplier, and whether friction couples these multipliers to the multipliers of the other
    rows. (The motion does not determine the multipliers of the other rows.)"""
    keep: list[Any] = []
    rubbing = rubs(system)
    unit, maps = _kernel_unit(system, parameters, list(range(system.rows)), rubbing)
    made = table(unit, keep)

    def call(name: str, *arrays: np.ndarray) -> None:
        operands = [*([made.scene] if name == "prepare" else []), *(a.ctypes.data for a in arrays)]
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(operands))(getattr(made, name))(*operands)

    probe = StructureProbe(system, made, maps, call)
    active = probe.active()
    return active, rubbing and probe.coupled(active)


def _kernel_unit(
    system: System, parameters: int, active: Sequence[int], redundant: bool, along: bool = False
) -> tuple[UnitDescription, Maps]:
    """Build the unit of the kernel. along: whether the friction of loops is solved along the recursion, like the friction of
    trees."""
    rubbed = bool(system.frictional) and (along or not system.cuts)
    s = ScenePasses(system, rubbed=rubbed)
    redundant = redundant and bool(system.frictional)
    stepping = EvaluationPrograms(s, active, redundant)
    if rubbed:
        RecursiveFriction(stepping)
    kernel_functions.write(s, redundant)
    qkind, vkind, quat = coordinate_kinds(system)
    turned = {e.joint.name: (at, n) for e, at, n in (rubbing_on_loops(system) if redundant else [])}
    more = [(n, n * (len(e.needs) + e.joint.kind.nv)) for e in stepping.elements for _, n in [turned.get(e.joint.name, (0, 0))]]
    elements, sliders, dn = element_table(stepping.elements, turned)
    paces, filled = frequencies(system), fill(system, active)
    each = len(system.frictional) + 3
    m = stepping.maps
    sizes = dict.fromkeys(KERNEL.integers, 0) | {
        "npowers": each, "ntaken": each - GIVING, "abi": number(), "nq": system.nq, "nv": system.nv,
        "nb": len(system.bristles), "nx": system.external.size, "np": parameters,
        "nc": s.nc, "nw": stepping.nw, "nmaps": m.at("end") + 1, "rows": system.rows, "active": len(active), "nkappa": m.nkappa,
        "nmore": sum(n for n, _ in more), "ndmore": sum(n for _, n in more), "loop_friction": int(rubs(system)),
        "neta": system.neta, "nn": m.nn, "nrates": m.nrates, "nlight": len(system.light),
        "nsliders": len(system.sliders), "nstops": system.stops, "nlatches": system.latches, "nunilateral": len(system.unilateral),
        "npositions": curve_positions(system),
        "ntables": system.tables, "nquat": len(quat),
        "nelements": len(elements), "npaces": len(paces), "nbodies": len(system.bodies), "ndn": dn,
        "sets": int(any(e.sets for e in stepping.elements)), "nfill": len(filled.below), "nS": m.at("Se"),
    }  # fmt: skip
    names = [*FUNCTIONS, *(RECURSIVE if rubbed else ()), *(COUPLING if rubbed and system.cuts else ())]
    integers = {"active_rows": active, "row_kind": row_kinds(system), "qkind": qkind, "vkind": vkind, "quat": quat}
    integers |= {"down": system.down, "presses": system.presses}
    integers |= tables_of(filled, m.entry)
    rows = {"element": (ELEMENT, elements), "pair": (PAIR, sliders), "pace": (PACE, paces)}
    rows["unilateral"] = (UNILATERAL, unilateral_table(system, active))
    return UnitDescription(KERNEL, DifferentiatedScene(s), sizes, {n: n for n in names}, integers, rows), m


def _outputs_unit(system: System, chosen: list[Column], quadratures: bool) -> UnitDescription:
    s = ScenePasses(system)
    ColumnPrograms(s, s.program("eval")).write(chosen)
    contacts, shares, post = write_contacts(s), write_shares(s), post_of(chosen)
    energy = next((i for i, c in enumerate(chosen) if c.name == "energy.residual"), -1)
    names = ["prepare", "eval", *(["contacts"] if contacts else []), *(["kappa"] if shares else [])]
    numbers = {
        "abi": number(), "nout": len(chosen), "ncontacts": contacts, "nc": s.nc, "nkappa": shares, "npost": len(post),
        "energy": energy, "works": int(quadratures), "wants": wants_of(chosen, any(REGISTRY[c.kind].solved for c in chosen)),
        "nloops": len(system.cuts),
    }  # fmt: skip
    functions = {n: n for n in names}
    return UnitDescription(OUTPUTS, DifferentiatedScene(s), numbers, functions, {**reaction_groups(system)}, {"post": (POST, post)})
