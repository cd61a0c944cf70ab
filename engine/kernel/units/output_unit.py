"""The output unit computes columns, contact forces, and the scaled reactions of all joints in loops. Redundant loops need the
scaled reactions."""

from __future__ import annotations

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.columns.kinds.contact import WATCHED
from trunnion.columns.registry import CONTACT
from trunnion.kernel.c_code.code_generator import Input, Output, emit
from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.interface.runtime_tables import post_of, wants_of
from trunnion.kernel.units.column_expressions import ColumnExpressions
from trunnion.kernel.units.generated_function_inputs import CONST, PREPARE, STATE, inputs, row_inputs, with_constants
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.redundant_loop_reactions import scaled_reactions
from trunnion.recursion.vector_algebra import SX


@dataclass
class OutputUnit:
    """C text of the unit. sizes: integers of ``tr_outputs``. operations: number of floating-point operations of a row without
    contacts."""

    text: str
    sizes: dict[str, int]
    post: list[tuple[int, ...]]
    operations: int


def output_unit(m: Model, chosen: list[Column], quadratures: bool) -> OutputUnit:
    """The unit for these columns."""
    o, sym = ColumnExpressions(m, quadratures), m.sym
    state, ny = inputs(sym), sym.system.nq + sym.system.nv + sym.b.numel()
    z = row_inputs(sym, o.a)
    values = [o.value(c) for c in chosen]
    more = [Input(f"y+{ny}", o.integrals, 1), Input("extra", o.runtime, 1)]
    stages = with_constants("o_prepare", "o_eval", f"{STATE},{CONST}z,{CONST}a,{CONST}extra,double*restrict out")
    main = emit(state + z + more, [Output("out", 0, values or [SX(0, 1)], 1)], stages)
    watched = ca.vertcat(SX(0, 1), *[o.output(CONTACT.name, (j.name,), "watched") for j in sym.system.frictional])
    contact = _second("contacts", state + z, ca.vertsplit(watched))
    loops = scaled_reactions(m, o.acc, o.pick)
    kappa = _second("kappa", state + z, [loops[i] for i in range(loops.numel())])
    a, b = main.kept[0], main.kept[0] + contact.kept[0]
    text = "\n".join([
        main.text, contact.text, kappa.text,
        f"void o_prepare_all({PREPARE})"
        f"{{o_prepare(p,c);o_prepare_contacts(p,c+{a});o_prepare_kappa(p,c+{b});}}",
        f"void o_contacts_at({STATE},{CONST}z,{CONST}a,double*restrict out){{o_contacts(x,y,c+{a},z,a,out);}}",
        f"void o_kappa_at({STATE},{CONST}z,{CONST}a,double*restrict out){{o_kappa(x,y,c+{b},z,a,out);}}",
    ])
    solved = bool(values) and ca.depends_on(ca.vertcat(*values), ca.vertcat(sym.lam, sym.eta, o.a))
    energy = next((i for i, c in enumerate(chosen) if c.name == "energy.residual"), -1)
    post = post_of(chosen)
    sizes = {
        "nout": len(chosen), "ncontacts": watched.numel() // WATCHED, "nc": b + kappa.kept[0], "nkappa": loops.numel(),
        "npost": len(post), "energy": energy, "works": int(quadratures), "wants": wants_of(chosen, solved),
    }  # fmt: skip
    return OutputUnit(text, sizes, post, main.operations[1])


def _second(name: str, ins: list[Input], values: list[SX]):
    stages = with_constants(f"o_prepare_{name}", f"o_{name}", f"{STATE},{CONST}z,{CONST}a,double*restrict out")
    return emit(ins, [Output("out", 0, values or [SX(0, 1)], 1)], stages)
