"""C sources of a system's kernel: generated functions and the tables the runtime reads (``engine.abi.kernels``)."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from engine.abi.kernels import ELEMENT, JACOBIAN, KERNEL, LINEAR, OUTPUTS, PACE, PAIR, POST
from engine.kernel.columns import Column
from engine.kernel.emit import MATH
from engine.kernel.jacobian_unit import jacobian_unit
from engine.kernel.linear_unit import linear_text
from engine.kernel.main_unit import MainUnit, main_unit
from engine.kernel.output_unit import OutputUnit, output_unit
from engine.kernel.records import coordinate_kinds, element_table, row_kinds
from engine.recursion.direct import direct_operators
from engine.recursion.reduction import model, unreduced
from engine.recursion.symbols import Symbols
from engine.system.coupling import fill, tables_of
from engine.system.loops import rows_of
from engine.system.pace import frequencies
from engine.system.structure import System

PREAMBLE = MATH + '#include "tr_abi.h"\n'


@dataclass
class KernelSource:
    """C text by unit name ("kernel", "outputs") and facts worth keeping beside the library."""

    units: dict[str, str]
    facts: dict[str, object]


@contextmanager
def _quickly() -> Iterator[None]:
    """Symbols are many, small and in use to the end: looking for garbage among them takes a twentieth of the time of a build."""
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
    """Symbolic build of everything a run needs (the Jacobian comes later, when a method asks for it)."""
    plain = unreduced(Symbols(system, parameters))
    main = main_unit(plain, quadratures, redundant)
    out = output_unit(plain, chosen, quadratures)
    operations = main.operations | {"outputs": out.operations}
    facts: dict[str, object] = {"operations": operations, "active_rows": list(main.sizes.active), "loop_rows": rows_of(system)}
    facts["rubbing"] = [j.name for j in system.frictional]
    return KernelSource({"kernel": _kernel_text(system, main), "outputs": _outputs_text(out)}, facts)


@_quickly()
def jacobian_source(system: System, parameters: int, redundant: bool) -> str:
    """C text of the Jacobian unit."""
    unit = jacobian_unit(model(Symbols(system, parameters)), redundant)
    names = ("j_eval", "0", "0") if unit.dense else ("0", "j_point", "j_along")
    functions = dict(zip(("eval", "point", "along"), names, strict=True))
    sizes = {"nc": unit.nc, "nw": unit.nw}
    struct = JACOBIAN.initialiser("trunnion_jacobian", abi="TR_ABI", **sizes, scene="0", prepare="j_prepare", **functions)
    return PREAMBLE + unit.text + struct


def linear_source(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> str:
    """C text of the linear unit."""
    text, nc = linear_text(system, parameters, chosen, quadratures, redundant)
    struct = LINEAR.initialiser(
        "trunnion_linear", abi="TR_ABI", nc=nc, ninputs=len(system.inputs), scene="0", prepare="l_prepare_all", rates="l_rates",
        columns="l_columns_at",
    )  # fmt: skip
    return PREAMBLE + text + struct


def _ints(name: str, values: Sequence[int]) -> str:
    """C text of a static table of integers; an empty one gets a zero, since C knows no empty tables."""
    return f"static const int {name}[]={{{','.join(map(str, values)) or '0'}}};\n"


def _kernel_text(system: System, main: MainUnit) -> str:
    z = main.sizes
    qkind, vkind, quat = coordinate_kinds(system)
    elements, sliders, dn = element_table(main.elements, main.turned)
    paces, filled = frequencies(system), fill(system, list(z.active))
    sizes = {n: getattr(z, n) for n in KERNEL.integers if hasattr(z, n)} | {
        "abi": "TR_ABI", "active": len(z.active), "nsliders": len(system.sliders), "nstops": system.stops,
        "nlatches": system.latches, "ntables": system.tables, "nquat": len(quat), "nelements": len(main.elements), "ndn": dn,
        "nmore": sum(n for _, n in main.turned.values()),
        "ndmore": sum(n * len(e.needs) for e in main.elements for _, n in [main.turned.get(e.joint.name, (0, 0))]),
        "npaces": len(paces), "nbodies": len(system.bodies),
        "sets": int(any(e.sets for e in main.elements)), "nfill": len(filled.below),
        "c_closure": "K_C_CLOSURE", "c_laws": "K_C_LAWS", "c_events": "K_C_EVENTS", "c_held": "K_C_HELD", "c_energy": "K_C_ENERGY",
        "c_pressed": "K_C_PRESSED",
    }  # fmt: skip
    tables = {"active_rows": z.active, "row_kind": row_kinds(system), "qkind": qkind, "vkind": vkind, "quat": quat}
    tables |= {"down": system.down, "presses": system.presses}
    tables |= tables_of(filled)
    named = ("stage1", "stage2", "laws", "laws_alone", "held", "held_alone", "pressed", "closure", "events", "qdot")
    functions = {n: f"k_{n}" for n in named}
    text = "".join(_ints(f"k_{n}", values) for n, values in tables.items())
    text += ELEMENT.table("k_element", elements) + PAIR.table("k_pair", sliders) + PACE.table("k_pace", paces)
    names = {n: f"k_{n}" for n in (*tables, "element", "pair", "pace")}
    names |= dict.fromkeys(("scene", "begin", "narrow", "respond", "answer", "shift", "derive"), "0")
    return PREAMBLE + main.text + text + KERNEL.initialiser(
        "trunnion_kernel", **sizes, **names, prepare="k_prepare_all", energy="0" if main.looped else "k_energy",
        **functions,
    )


def _outputs_text(out: OutputUnit) -> str:
    struct = OUTPUTS.initialiser(
        "trunnion_outputs", abi="TR_ABI", nout=out.nout, ncontacts=out.ncontacts, nc=out.nc, nkappa=out.nkappa, npost=len(out.post),
        energy=out.energy, works=out.works, wants=out.wants, post="o_post", scene="0", prepare="o_prepare_all", eval="o_eval",
        contacts="o_contacts_at" if out.ncontacts else "0", kappa="o_kappa_at" if out.nkappa else "0",
    )  # fmt: skip
    return PREAMBLE + out.text + POST.table("o_post", out.post) + struct
