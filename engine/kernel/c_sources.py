"""C sources of a kernel: generated functions and the tables that the runtime reads (``trunnion.runtime.abi.kernel_records``)."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.c_code.code_generator import MATH
from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.interface.runtime_tables import coordinate_kinds, element_table, row_kinds, unilateral_table
from trunnion.kernel.units.jacobian_unit import jacobian_unit
from trunnion.kernel.units.linearization_unit import linear_text
from trunnion.kernel.units.output_unit import OutputUnit, output_unit
from trunnion.kernel.units.stepping_unit import MainUnit, main_unit
from trunnion.recursion.fast_casadi_arithmetic import direct_operators
from trunnion.recursion.inward_reduction import build_model, model
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.runtime.abi.kernel_records import ELEMENT, JACOBIAN, KERNEL, LINEAR, OUTPUTS, PACE, PAIR, POST, UNILATERAL
from trunnion.system.signals.excitation_frequencies import frequencies
from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.force_curve_positions import curve_positions
from trunnion.system.structure.loop_joints import rows_of
from trunnion.system.structure.loop_matrix_fill import fill, tables_of
from trunnion.system.structure.redundant_loop_groups import reaction_groups

PREAMBLE = MATH + '#include "tr_abi.h"\n'


@dataclass
class KernelSource:
    """C text by name of the unit ("kernel", "outputs"), and facts that are stored beside the library."""

    units: dict[str, str]
    facts: dict[str, object]


@contextmanager
def _quickly() -> Iterator[None]:
    """Switch garbage collection off during a build. Garbage collection would take a twentieth of the time, because a build has many
    small symbols, which all stay in use until the end."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        with direct_operators():
            yield
    finally:
        if enabled:
            gc.enable()


@_quickly()
def kernel_source(
    system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool = False
) -> KernelSource:
    """C sources for a run. The Jacobian unit is separate (``jacobian_source``), because few methods need it."""
    plain = build_model(Symbols(system, parameters))
    main = main_unit(plain, redundant)
    out = output_unit(plain, chosen, quadratures)
    operations = main.operations | {"outputs": out.operations}
    facts: dict[str, object] = {"operations": operations, "active_rows": main.active, "loop_rows": rows_of(system)}
    facts["rubbing"] = [j.name for j in system.frictional]
    return KernelSource({"kernel": _kernel_text(system, main), "outputs": _outputs_text(system, out)}, facts)


@_quickly()
def jacobian_source(system: System, parameters: int, redundant: bool) -> str:
    """C text of the Jacobian unit (``units/jacobian_unit.py``)."""
    unit = jacobian_unit(model(Symbols(system, parameters)), redundant)
    made = ("eval",) if unit.dense else ("point", "along")
    functions = {n: f"j_{n}" if n in made else "0" for n in ("eval", "point", "along")}
    return PREAMBLE + unit.text + JACOBIAN.initialiser(
        "trunnion_jacobian", abi="TR_ABI", nc=unit.nc, nw=unit.nw, scene="0", prepare="j_prepare", **functions,
    )  # fmt: skip


def linear_source(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> str:
    """C text of the linearization unit (``units/linearization_unit.py``)."""
    text, nc = linear_text(system, parameters, chosen, quadratures, redundant)
    struct = LINEAR.initialiser(
        "trunnion_linear", abi="TR_ABI", nc=nc, ninputs=len(system.inputs), scene="0", prepare="l_prepare_all", rates="l_rates",
        columns="l_columns_at",
    )  # fmt: skip
    return PREAMBLE + text + struct


def _ints(name: str, values: Sequence[int]) -> str:
    """C text of a static table of integers. An empty table gets a zero, because C allows no empty arrays."""
    return f"static const int {name}[]={{{','.join(map(str, values)) or '0'}}};\n"


def _kernel_text(system: System, main: MainUnit) -> str:
    qkind, vkind, quat = coordinate_kinds(system)
    elements, sliders, dn = element_table(main.elements, main.turned)
    paces, filled = frequencies(system), fill(system, main.active)
    sizes = main.sizes | {
        "abi": "TR_ABI", "nsliders": len(system.sliders), "nstops": system.stops,
        "nlatches": system.latches, "npositions": curve_positions(system), "nunilateral": len(system.unilateral),
        "ntables": system.tables, "nquat": len(quat), "nelements": len(main.elements), "ndn": dn,
        "nmore": sum(n for _, n in main.turned.values()),
        "ndmore": sum(main.turned.get(e.joint.name, (0, 0))[1] * (len(e.needs) + e.joint.kind.nv) for e in main.elements),
        "npaces": len(paces), "nbodies": len(system.bodies), "nlight": len(system.light),
        "sets": int(any(e.sets for e in main.elements)), "nfill": len(filled.below), "nS": len(main.active) ** 2,
    } | {n: f"K_{n.upper()}" for n in KERNEL.integers if n.startswith("c_")}  # fmt: skip
    tables: dict[str, Sequence[int]] = {"active_rows": main.active, "row_kind": row_kinds(system), "qkind": qkind, "vkind": vkind}
    tables |= {"quat": quat, "down": system.down, "presses": system.presses}
    tables |= tables_of(filled, lambda row, column: row + len(main.active) * column)
    named = ("stage1", "stage2", "laws", "laws_alone", "held", "held_alone", "pressed", "closure", "events", "qdot", "energy")
    text = "".join(_ints(f"k_{n}", values) for n, values in tables.items())
    text += ELEMENT.table("k_element", elements) + PAIR.table("k_pair", sliders) + PACE.table("k_pace", paces)
    text += UNILATERAL.table("k_unilateral", unilateral_table(system, main.active))
    names = {n: f"k_{n}" for n in (*tables, *named, "element", "pair", "pace", "unilateral")}
    names |= dict.fromkeys(("scene", "begin", "narrow", "respond", "answer", "shift", "derive"), "0")
    return PREAMBLE + main.text + text + KERNEL.initialiser("trunnion_kernel", **sizes, **names, prepare="k_prepare_all")


def _outputs_text(system: System, out: OutputUnit) -> str:
    tables = reaction_groups(system)
    struct = OUTPUTS.initialiser(
        "trunnion_outputs", abi="TR_ABI", **out.sizes, post="o_post", scene="0", prepare="o_prepare_all", eval="o_eval",
        contacts="o_contacts_at" if out.sizes["ncontacts"] else "0", kappa="o_kappa_at" if out.sizes["nkappa"] else "0",
        nloops=len(system.cuts), **{name: f"o_{name}" for name in tables},
    )  # fmt: skip
    return PREAMBLE + out.text + "".join(_ints(f"o_{n}", t) for n, t in tables.items()) + POST.table("o_post", out.post) + struct
