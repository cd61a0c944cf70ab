"""The linear unit: exact derivatives along a direction, for linearisation and for hosts that ask for directional derivatives.

Of F = [q̇; v̇; friction states; powers] and the residuals R of the multipliers (``jacobian_unit``), and of the columns. Each is one
product with a seed, so that its code grows only linearly with the number of bodies.
"""

from __future__ import annotations

import casadi as ca

from engine.kernel.calling import CONST, PREPARE, STATE, active_rows, combination, inputs, qdot
from engine.kernel.columns import Column
from engine.kernel.emit import Input, Output, Stage, emit
from engine.kernel.jacobian_unit import residuals
from engine.kernel.output_unit import Outputs
from engine.recursion.accelerations import outward
from engine.recursion.elements import bristle_rates
from engine.recursion.reduction import Model, reduced, unreduced
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX
from engine.system.external import TABLE
from engine.system.structure import System

CALL = f"{STATE},{CONST}z,{CONST}seed,double*restrict out"
CALL_COLUMNS = f"{STATE},{CONST}z,{CONST}a,{CONST}seed,double*restrict out"


def linear_text(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> tuple[str, int]:
    """C text of the unit's functions, and how many constants they keep."""
    plain = unreduced(Symbols(system, parameters))
    rates, kept = _rates(reduced(plain), redundant)
    columns, more = _columns(plain, chosen, quadratures)
    both = (
        f"void l_prepare_all({PREPARE}){{l_prepare(p,c);l_prepare_columns(p,c+{kept});}}\n"
        f"void l_columns_at({CALL_COLUMNS}){{l_columns(x,y,c+{kept},z,a,seed,out);}}\n"
    )
    return "\n".join([rates, columns, both]), kept + more


def _along(values: SX, x: SX, first: int, count: int, others: list[SX]) -> tuple[SX, SX]:
    """Derivative of ``values`` along a seed, and the symbol of that seed: ``count`` entries for those of x from ``first`` on, then
    one for each entry of the others."""
    seed = SX.sym("seed", count + sum(int(o.numel()) for o in others))
    direction = SX.zeros(x.numel())
    for i in range(count):
        direction[first + i] = seed[i]
    return ca.jtimes(values, ca.vertcat(x, *others), ca.vertcat(direction, seed[count:])), seed


def _rates(m: Model, redundant: bool) -> tuple[str, int]:
    """C text of the derivative of [F; R] along [inputs, y, z = (active λ, η)], and how many constants it keeps."""
    sym = m.sym
    active = list(range(sym.system.rows)) if redundant else list(active_rows(m))
    pick = combination(sym)
    acc = outward(m, pick)
    rate = [*qdot(sym, sym.v), *[a[i] for a in acc.qdd for i in range(a.numel())], *bristle_rates(m, acc, pick)]
    f = ca.vertcat(SX(0, 1), *rate, residuals(m, acc, pick, active))
    inactive = [k for k in range(sym.system.rows) if k not in active]
    if inactive:
        f = ca.substitute(f, ca.vertcat(*[sym.lam[k] for k in inactive]), SX.zeros(len(inactive)))
    lam = ca.vertcat(SX(0, 1), *[sym.lam[k] for k in active])
    count = TABLE * len(sym.system.inputs)
    column, seed = _along(f, sym.x, sym.at.table(0), count, [sym.q, sym.v, sym.b, lam, sym.eta])
    ins = [*inputs(sym), Input("z", lam, 1), Input(f"z+{len(active)}", sym.eta, 1), Input("seed", seed, 1)]
    stages = [Stage("l_prepare", f"{CONST}p,double*restrict c", "c"), Stage("l_rates", CALL, "")]
    code = emit(ins, [Output("out", 0, column, 1)], stages)
    return code.text, code.kept[0]


def _columns(m: Model, chosen: list[Column], quadratures: bool) -> tuple[str, int]:
    """The same of the columns, along [inputs, y, λ of all rows, η, accelerations of the free rates]. Integrals, and what only the
    runtime knows, count as constant."""
    o, sym = Outputs(m, quadratures), m.sym
    values = [o.value(c.key) if c.quantity.instantaneous else SX(0) for c in chosen]
    count = TABLE * len(sym.system.inputs)
    others = [sym.q, sym.v, sym.b, sym.lam, sym.eta, o.a]
    column, seed = _along(ca.vertcat(SX(0, 1), *values), sym.x, sym.at.table(0), count, others)
    z = [Input("z", sym.lam, 1), Input(f"z+{sym.system.rows}", sym.eta, 1)]
    ins = [*inputs(sym), *z, Input("a", o.a, 1), Input("seed", seed, 1)]
    stages = [Stage("l_prepare_columns", f"{CONST}p,double*restrict c", "c"), Stage("l_columns", CALL_COLUMNS, "")]
    code = emit(ins, [Output("out", 0, column, 1)], stages)
    return code.text, code.kept[0]
