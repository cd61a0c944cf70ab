"""The sensitivity unit: exact directional derivatives of everything a trajectory is made of, parameters included.

Motion: f = [F; R; V; H] with F = [q̇; v̇; friction states; powers], R the residuals of the multipliers (``jacobian_unit``),
V the rates of all frictional freedoms and H the friction ratio of pairs at rest less one (which release them at zero); by
[x, y, z, p, u] (u: values of the external inputs).
Outputs: the chosen columns by [x, y, λ of all rows, η, v̇, integrals, p, u]. Both in stages: parameters once, the point once, then a
direction at a time.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from engine.kernel.calling import CONST, STATE, active_rows, combination, inputs, qdot
from engine.kernel.columns import Column
from engine.kernel.emit import MATH, Input, Output, Stage, emit
from engine.kernel.jacobian_unit import residuals, time_direction
from engine.kernel.output_unit import Outputs
from engine.kernel.powers import powers
from engine.recursion.accelerations import Accelerations, outward
from engine.recursion.elements import bristle_rates, joint_rates, laws, numbers, reaction_rows, wrench
from engine.recursion.reduction import Model, reduced, unreduced
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX
from engine.system.elements import elements
from engine.system.structure import System


@dataclass
class ParameterUnit:
    """C text, and the sizes its callers need: kept values of every stage (constants, point) and lengths of the results."""

    text: str
    sizes: dict[str, int]


def parameter_unit(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> ParameterUnit:
    """Build the sensitivity unit of a system for the chosen columns."""
    sym = Symbols(system, parameters)
    plain = unreduced(sym)
    m = reduced(plain)
    active = list(range(system.rows)) if redundant else list(active_rows(m))
    motion, counts = _motion(m, quadratures, active)
    outputs, more = _outputs(plain, chosen, quadratures)
    return ParameterUnit(MATH + motion + outputs, counts | more)


def _motion(m: Model, quadratures: bool, active: list[int]) -> tuple[str, dict[str, int]]:
    sym, pick = m.sym, combination(m.sym)
    acc = outward(m, pick)
    rate = [*qdot(sym, sym.v), *[a[i] for a in acc.qdd for i in range(a.numel())], *bristle_rates(m, acc, pick)]
    extra = [p for _, p in powers(m, acc, pick)] if quadratures else []
    rest = residuals(m, acc, pick, active)
    rates = [r for e in elements(sym.system) for r in joint_rates(m, e.joint)]
    holds = _holds(m, acc, pick)
    f = ca.vertcat(SX(0, 1), *rate, *extra, rest, *rates, *holds)
    inactive = [k for k in range(sym.system.rows) if k not in active]
    if inactive:
        f = ca.substitute(f, ca.vertcat(*[sym.lam[k] for k in inactive]), SX.zeros(len(inactive)))
    lam = ca.vertcat(SX(0, 1), *[sym.lam[k] for k in active])
    ins = [*inputs(sym), Input("z", lam, 1), Input(f"z+{len(active)}", sym.eta, 1)]
    along = ca.vertcat(sym.q, sym.v, sym.b, lam, sym.eta, sym.p)
    text, kept = _staged("s", ins, f, along, sym, f"{CONST}z")
    counts = {"states": len(rate), "powers": len(extra), "residuals": rest.numel(), "rates": len(rates), "holds": len(holds)}
    return text, counts | kept | {"active": len(active)}


def _holds(m: Model, acc: Accelerations, pick: SX) -> list[SX]:
    """Friction ratio − 1 of every pair of a set-valued law, as if at rest; −1 for other laws."""
    out: list[SX] = [SX(-1)] * len(m.sym.system.sliders)
    for e in elements(m.sym.system):
        if not e.sets:
            continue
        w = wrench(e, reaction_rows(m, acc, e, pick))
        found = e.contact.held(w, [m.sym.eta[i] for i in e.eta], laws(m.sym, e), numbers(m.sym, e), e.friction.adams)
        for s, hold in zip(e.friction.sliders, found, strict=True):
            out[s.flag] = hold.size / hold.capacity - 1
    return out


def _outputs(m: Model, chosen: list[Column], quadratures: bool) -> tuple[str, dict[str, int]]:
    o, sym = Outputs(m, quadratures), m.sym
    ny = sym.system.nq + sym.system.nv + sym.b.numel()
    values = ca.densify(ca.vertcat(SX(0, 1), *[o.value(c.key) for c in chosen]))
    ins = [*inputs(sym), Input("z", sym.lam, 1), Input(f"z+{sym.system.rows}", sym.eta, 1), Input("a", o.a, 1),
           Input(f"y+{ny}", o.quad, 1), Input("extra", o.extra, 1)]
    along = ca.vertcat(sym.q, sym.v, sym.b, o.quad, sym.lam, sym.eta, o.a, sym.p)
    text, kept = _staged("so", ins, values, along, sym, f"{CONST}z,{CONST}a,{CONST}extra")
    return text, {f"o_{k}": n for k, n in kept.items()} | {"extra": o.extra.numel()}


def _staged(name: str, ins: list[Input], f: SX, along: SX, sym: Symbols, more: str) -> tuple[str, dict[str, int]]:
    """prepare(p, c); point(x, y, c, …, w, f); along(x, y, c, …, w, seed, df) with seed = [by ``along``, external inputs, time]."""
    count = len(sym.system.inputs)
    seed = SX.sym("seed", along.numel() + count + 1)
    outside = time_direction(sym) * seed[-1]
    for i in range(count):
        outside[sym.at.table(i)] += seed[along.numel() + i]
    column = ca.jtimes(f, ca.vertcat(along, sym.x), ca.vertcat(seed[: along.numel()], outside))
    stages = [
        Stage(f"{name}_prepare", f"{CONST}p,double*restrict c", "c"),
        Stage(f"{name}_point", f"{STATE},{more},double*restrict w,double*restrict f", "w"),
        Stage(f"{name}_along", f"{STATE},{more},{CONST}w,{CONST}seed,double*restrict df", ""),
    ]
    outs = [Output("f", 0, f, 1), Output("df", 0, ca.densify(column), 2)] if f.numel() else []
    code = emit([*ins, Input("seed", seed, 2)], outs, stages)
    return code.text, {"constants": code.kept[0], "point": code.kept[1], "values": f.numel()}
