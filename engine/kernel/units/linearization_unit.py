"""The linearization unit computes exact derivatives along a direction. The unit gives derivatives of F = [q̇; v̇; friction states;
powers], of the multiplier residuals R (``jacobian_unit``) and of the columns. Linearisation, and hosts that request directional
derivatives, use this unit. Each function computes the product of the derivatives with one seed, so the code grows linearly with the
number of bodies. """

from __future__ import annotations

import casadi as ca

from trunnion.kernel.c_code.code_generator import Input, Output, Stage, emit
from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.units.column_expressions import ColumnExpressions
from trunnion.kernel.units.generated_function_inputs import (
    CONST,
    PREPARE,
    STATE,
    Multipliers,
    combination,
    inputs,
    row_inputs,
    state_rates,
    with_constants,
)
from trunnion.kernel.units.jacobian_unit import residuals
from trunnion.recursion.inward_reduction import Model, build_model, reduce_model
from trunnion.recursion.outward_accelerations import outward
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.external_value_layout import TABLE

CALL = f"{STATE},{CONST}z,{CONST}seed,double*restrict out"
CALL_COLUMNS = f"{STATE},{CONST}z,{CONST}a,{CONST}seed,double*restrict out"


def linear_text(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> tuple[str, int]:
    """C text of the unit's functions, and their number of constants."""
    plain = build_model(Symbols(system, parameters))
    rates, kept = _rates(reduce_model(plain), redundant)
    columns, more = _columns(plain, chosen, quadratures)
    both = (
        f"void l_prepare_all({PREPARE}){{l_prepare(p,c);l_prepare_columns(p,c+{kept});}}\n"
        f"void l_columns_at({CALL_COLUMNS}){{l_columns(x,y,c+{kept},z,a,seed,out);}}\n"
    )
    return "\n".join([rates, columns, both]), kept + more


def _along(sym: Symbols, values: SX, others: list[SX], more: list[Input], stages: list[Stage]) -> tuple[str, int]:
    """C text of the derivative of ``values`` along a seed of [inputs, others], and its number of constants."""
    count, first = TABLE * len(sym.system.inputs), sym.at.table(0)
    seed = SX.sym("seed", count + sum(int(o.numel()) for o in others))
    direction = SX.zeros(sym.x.numel())
    for i in range(count):
        direction[first + i] = seed[i]
    column = ca.jtimes(values, ca.vertcat(sym.x, *others), ca.vertcat(direction, seed[count:]))
    code = emit([*inputs(sym), *more, Input("seed", seed, 1)], [Output("out", 0, column, 1)], stages)
    return code.text, code.kept[0]


def _rates(m: Model, redundant: bool) -> tuple[str, int]:
    """C text of the derivative of [F; R] along [inputs, y, z = (active λ, η)], and its number of constants."""
    sym, multipliers, pick = m.sym, Multipliers(m, redundant), combination(m.sym)
    acc = outward(m, pick)
    f = ca.vertcat(SX(0, 1), *state_rates(m, acc, pick), residuals(m, acc, pick, multipliers.active))
    (f,) = multipliers.without_inactive([f])
    others = [sym.q, sym.v, sym.b, multipliers.lam, sym.eta]
    return _along(sym, f, others, multipliers.inputs(1), with_constants("l_prepare", "l_rates", CALL))


def _columns(m: Model, chosen: list[Column], quadratures: bool) -> tuple[str, int]:
    """C text of the derivative of columns, and its number of constants. The direction is [inputs, y, λ of all rows, η,
    accelerations of the free rates]. Integrals, and values that the runtime computes, are treated as constants."""
    o, sym = ColumnExpressions(m, quadratures), m.sym
    values = [o.value(c) if c.quantity.instantaneous else SX(0) for c in chosen]
    others = [sym.q, sym.v, sym.b, sym.lam, sym.eta, o.a]
    stages = with_constants("l_prepare_columns", "l_columns", CALL_COLUMNS)
    return _along(sym, ca.vertcat(SX(0, 1), *values), others, row_inputs(sym, o.a), stages)
