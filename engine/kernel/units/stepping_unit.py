"""The stepping unit: prepare, stage 1 (maps), laws, stage 2 (accelerations), closure of loops, coordinate rates.

Between stage 1 and stage 2 the runtime solves for the multipliers (theory, "Affine maps"). No function depends on the modes of
set-valued pairs. Stage 1 writes one block, "maps", of column-major matrices (``runtime/base/map_block_offsets.h``):

  S, Se, g0     constraint equations S λ + Se η + g0 = 0
  N0, Nl, Ne    reaction components of frictional joints: N0 + Nl λ + Ne η
  rates         rates of the freedoms of frictional joints, then states of friction laws
  Q0, Ql, Qe    accelerations of these freedoms, if a law is set-valued
  κ0, κl, κe    scaled reactions with friction as an applied force, in the redundant variant
"""

from __future__ import annotations

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.c_code.code_generator import Code, Output, Stage, emit
from trunnion.kernel.interface.runtime_tables import GIVING
from trunnion.kernel.units.generated_function_inputs import CONST, PARAMETERS, STATE, Multipliers, combination, inputs, state_rates
from trunnion.kernel.units.power_expressions import powers
from trunnion.kernel.units.stepping_unit_functions import (
    closure_function,
    coordinate_rates_function,
    energy_function,
    held_function,
    laws_function,
    prepare_all,
    pressed_function,
    stops_function,
)
from trunnion.recursion.complement_equation_terms import acceleration_rows, joint_rates, reaction_rows
from trunnion.recursion.inward_reduction import Model, reduce_model
from trunnion.recursion.outward_accelerations import outward
from trunnion.recursion.redundant_loop_reactions import inactive_rows_couple, scaled_reactions
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.friction_joint_indices import Element, any_sets, elements
from trunnion.system.structure.loop_joints import rubbing_on_loops, rubs

PROTOTYPES = f"void k_qdot({CONST}y,{CONST}v,{CONST}c,double*restrict dq);"


@dataclass
class MainUnit:
    """C text of the stepping unit. sizes: sizes of ``tr_kernel``. active: indices of the active constraint rows."""

    text: str
    sizes: dict[str, int]
    active: list[int]
    elements: list[Element]
    operations: dict[str, int]
    turned: dict[str, tuple[int, int]]
    """For joints in loops with friction: index of the first scaled reaction that friction changes, and number of these reactions
    (``rubbing_on_loops``)."""


def main_unit(plain: Model, redundant: bool = False) -> MainUnit:
    """The stepping unit of a model to which the inward reduction has not been applied. redundant: whether to build the variant with
    all rows and with scaled reactions."""
    sym = plain.sym
    system, parts = sym.system, elements(sym.system)
    m = reduce_model(plain)
    multipliers = Multipliers(m, redundant)
    active = multipliers.active
    maps, nn, nrates, nkappa = _maps(m, parts, active, redundant)
    loop_friction = rubs(system)
    coupled = loop_friction and inactive_rows_couple(m, outward(m), multipliers.inactive)
    rate, each = _derivative(m)
    code = _stages(multipliers, maps, rate, each)
    closure = closure_function(m)
    laws_code = laws_function(sym, parts)
    rates_code = coordinate_rates_function(sym)
    stops_code = stops_function(m)
    turned = rubbing_on_loops(system) if nkappa else []
    held = held_function(sym, parts)
    codes = [code, closure, laws_code, stops_code, held, energy_function(m), pressed_function(sym, turned)]
    text = "\n".join([PROTOTYPES, *(c.text for c in codes), rates_code.text, prepare_all(codes)])
    sizes = {
        "nq": system.nq, "nv": system.nv, "nb": sym.b.numel(), "nx": sym.x.shape[0], "np": sym.p.shape[0], "nw": code.kept[1],
        "nmaps": sum(int(v.numel()) for v in maps), "rows": system.rows, "active": len(active), "neta": system.neta, "nn": nn,
        "nrates": nrates, "npowers": len(each), "ntaken": len(each) - GIVING, "nkappa": nkappa,
        "loop_friction": int(loop_friction), "coupled": int(coupled), "nc": sum(c.kept[0] for c in codes),
    }  # fmt: skip
    ops = {"prepare": code.operations[0], "stage1": code.operations[1], "stage2": code.operations[2],
           "laws": laws_code.operations[1], "closure": closure.operations[1], "held": held.operations[1]}
    return MainUnit(text, sizes, active, parts, ops, {e.joint.name: (at, count) for e, at, count in turned})


def _stages(multipliers: Multipliers, maps: list[SX], rate: list[SX], each: list[SX]) -> Code:
    """prepare, stage 1 and stage 2, unrolled. Inactive multipliers do not occur in the motion."""
    sym = multipliers.sym
    last = 2 if multipliers.active or sym.system.neta > 0 else 1
    stages = [
        Stage("k_prepare", PARAMETERS, "c"),
        Stage("k_stage1", f"{STATE},double*restrict w,double*restrict maps,double*restrict dy,double*restrict power", "w"),
        Stage("k_stage2", f"{STATE},{CONST}w,{CONST}z,double*restrict dy,double*restrict power", ""),
    ]
    outputs = [
        Output("maps", 0, maps, 1),
        Output("dy", 0, multipliers.without_inactive(rate), last),
        Output("power", 0, each, last),
    ]
    return emit([*inputs(sym), *multipliers.inputs(2)], outputs, stages)


def _maps(m: Model, parts: list[Element], active: list[int], redundant: bool) -> tuple[list[SX], int, int, int]:
    """(blocks of the maps, numbers of reaction components, rates and scaled reactions)."""
    system = m.sym.system
    blocks = [ca.vec(ca.densify(m.S[active, active])), ca.vec(ca.densify(m.Se[active, :])), ca.densify(m.g0[active])]
    nn = nrates = nkappa = 0
    if parts:
        acc = outward(m)
        rows = ca.vertcat(*[reaction_rows(m, acc, e) for e in parts])
        nl, nn = system.rows, rows.size1()
        lam = rows[:, 1 : 1 + nl][:, active]
        blocks += [ca.densify(rows[:, 0]), ca.vec(ca.densify(lam)), ca.vec(ca.densify(rows[:, 1 + nl :]))]
        rates = [r for e in parts for r in joint_rates(m, e.joint)]
        rates += [m.sym.b[i] for i in range(m.sym.b.numel())]
        nrates = len(rates)
        blocks += rates
        if any_sets(system):
            held = ca.vertcat(*[acceleration_rows(m, acc, e.joint) for e in parts])
            lam = held[:, 1 : 1 + nl][:, active]
            blocks += [ca.densify(held[:, 0]), ca.vec(ca.densify(lam)), ca.vec(ca.densify(held[:, 1 + nl :]))]
        if redundant:
            kappa = scaled_reactions(m, acc)
            nkappa = kappa.size1()
            blocks += [ca.densify(kappa[:, 0]), ca.vec(ca.densify(kappa[:, 1 : 1 + nl])), ca.vec(ca.densify(kappa[:, 1 + nl :]))]
    return [ca.densify(b) for b in blocks if b.numel()] or [SX(0, 1)], nn, nrates, nkappa


def _derivative(m: Model) -> tuple[list[SX], list[SX]]:
    """ẏ and the powers. All powers are generated, even if no column needs them. With other surrounding text, the compiler would
    round the motion differently."""
    sym = m.sym
    pick = combination(sym)
    acc = outward(m, pick, reactions=sym.b.numel() > 0 or any(j.driven for j in sym.system.tree))
    return state_rates(m, acc, pick), [p for _, p in powers(m, acc, pick)]
