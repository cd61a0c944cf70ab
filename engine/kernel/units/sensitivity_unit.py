"""The sensitivity unit: exact directional derivatives of a trajectory, also by parameters.

Motion: derivatives of f = [F; R; V; H; L] by [x, y, z, p, u]. F = [q̇; v̇; friction states; powers]. R: multiplier residuals
(``jacobian_unit``). V: rates of all freedoms of frictional joints. H: friction ratio minus one for pairs at rest; zero at their
release. L: distance of each latch's hook from its release. u: values of the external inputs.

Outputs: derivatives of the columns by [x, y, λ of all rows, η, v̇, integrals, p, u]. Both parts have three stages: parameters,
point, then one direction at a time."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from trunnion.kernel.c_code.code_generator import MATH, Input, Output, Stage, emit
from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.units.column_expressions import ColumnExpressions
from trunnion.kernel.units.jacobian_unit import residuals, time_direction
from trunnion.kernel.units.power_expressions import coordinates_of, powers
from trunnion.kernel.units.unit_inputs import CONST, PARAMETERS, STATE, Multipliers, combination, inputs, row_inputs, state_rates
from trunnion.recursion import latch_forces
from trunnion.recursion.complement_equation_terms import joint_rates, laws, numbers, reaction_rows, wrench
from trunnion.recursion.inward_reduction import Model, build_model, reduce_model
from trunnion.recursion.outward_accelerations import Accelerations, outward
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.friction_joint_indices import elements

_GIVEN = f"({STATE},{CONST}z,{CONST}a,{CONST}extra,double*restrict w"
_SEEDS = "int count,const double*seeds,size_t next,double*out,size_t next_out"
MANY = f"""#include <stddef.h>
void s_point_of{_GIVEN},double*restrict f){{s_point(x,y,c,z,w,f);}}
void s_along_many{_GIVEN},{_SEEDS}){{for(int k=0;k<count;++k)s_along(x,y,c,z,w,seeds+k*next,out+k*next_out);}}
void so_point_of{_GIVEN},double*restrict f){{so_point(x,y,c,z,a,extra,w,f);}}
void so_along_many{_GIVEN},{_SEEDS}){{for(int k=0;k<count;++k)so_along(x,y,c,z,a,extra,w,seeds+k*next,out+k*next_out);}}
"""
"""The same functions with the arguments of ``tr_tangents``, for many seeds in one call."""


@dataclass
class ParameterUnit:
    """C text; numbers of values kept (for constants and point) and of results."""

    text: str
    sizes: dict[str, int]


def parameter_unit(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> ParameterUnit:
    """The sensitivity unit of a system for these columns."""
    sym = Symbols(system, parameters)
    plain = build_model(sym)
    motion, counts = _motion(reduce_model(plain), quadratures, redundant)
    outputs, more = _outputs(plain, chosen, quadratures)
    return ParameterUnit(MATH + motion + outputs + MANY, counts | more)


def _motion(m: Model, quadratures: bool, redundant: bool) -> tuple[str, dict[str, int]]:
    sym, pick, multipliers = m.sym, combination(m.sym), Multipliers(m, redundant)
    acc = outward(m, pick)
    rate = state_rates(m, acc, pick)
    extra = [p for _, p in powers(m, acc, pick)] if quadratures else []
    rest = residuals(m, acc, pick, multipliers.active)
    rates = [r for e in elements(sym.system) for r in joint_rates(m, e.joint)]
    holds = _holds(m, acc, pick)
    hooks = _hooks(m)
    f = ca.vertcat(SX(0, 1), *rate, *extra, rest, *rates, *holds, *hooks)
    (f,) = multipliers.without_inactive([f])
    along = ca.vertcat(sym.q, sym.v, sym.b, multipliers.lam, sym.eta, sym.p)
    text, kept = _staged("s", [*inputs(sym), *multipliers.inputs(1)], f, along, sym, f"{CONST}z")
    counts = {"states": len(rate), "powers": len(extra), "residuals": rest.numel(), "rates": len(rates), "holds": len(holds)}
    counts |= {"hooks": len(hooks)}
    return text, counts | kept | {"active": len(multipliers.active)}


def _holds(m: Model, acc: Accelerations, pick: SX) -> list[SX]:
    """(Friction ratio − 1) of every pair with a set-valued law, computed as if the pair were at rest. For other laws the entry is
    −1."""
    out: list[SX] = [SX(-1)] * len(m.sym.system.sliders)
    for e in elements(m.sym.system):
        if not e.sets:
            continue
        w = wrench(e, reaction_rows(m, acc, e, pick))
        found = e.contact.held(w, [m.sym.eta[i] for i in e.eta], laws(m.sym, e), numbers(m.sym, e), e.friction.adams)
        for s, hold in zip(e.friction.sliders, found, strict=True):
            out[s.flag] = hold.size / hold.capacity - 1
    return out


def _hooks(m: Model) -> list[SX]:
    """The event function of every latch's hook."""
    out: list[SX] = [SX(0)] * m.sym.system.latches
    for j in m.sym.system.joints:
        for k, d in enumerate(j.devices):
            if d.latch is not None:
                q, hook = coordinates_of(m, j)[j.kind.coordinate_of(k)], m.sym.latch_flags(d.latch)[0]
                out[d.latch.hook] = latch_forces.depths(m.sym, d.latch, hook, q, m.sym.load(d.latch.release))[0]
    return out


def _outputs(m: Model, chosen: list[Column], quadratures: bool) -> tuple[str, dict[str, int]]:
    o, sym = ColumnExpressions(m, quadratures), m.sym
    ny = sym.system.nq + sym.system.nv + sym.b.numel()
    values = ca.densify(ca.vertcat(SX(0, 1), *[o.value(c) for c in chosen]))
    ins = [*inputs(sym), *row_inputs(sym, o.a), Input(f"y+{ny}", o.integrals, 1), Input("extra", o.runtime, 1)]
    along = ca.vertcat(sym.q, sym.v, sym.b, o.integrals, sym.lam, sym.eta, o.a, sym.p)
    text, kept = _staged("so", ins, values, along, sym, f"{CONST}z,{CONST}a,{CONST}extra")
    return text, {f"o_{k}": n for k, n in kept.items()} | {"extra": o.runtime.numel()}


def _staged(name: str, ins: list[Input], f: SX, along: SX, sym: Symbols, more: str) -> tuple[str, dict[str, int]]:
    """C text and sizes of prepare(p, c), point(x, y, c, …, w, f) and along(x, y, c, …, w, seed, df). A seed is a direction of
    [``along``, external inputs, time]."""
    count = len(sym.system.inputs)
    seed = SX.sym("seed", along.numel() + count + 1)
    outside = time_direction(sym) * seed[-1]
    for i in range(count):
        outside[sym.at.table(i)] += seed[along.numel() + i]
    column = ca.jtimes(f, ca.vertcat(along, sym.x), ca.vertcat(seed[: along.numel()], outside))
    stages = [
        Stage(f"{name}_prepare", PARAMETERS, "c"),
        Stage(f"{name}_point", f"{STATE},{more},double*restrict w,double*restrict f", "w"),
        Stage(f"{name}_along", f"{STATE},{more},{CONST}w,{CONST}seed,double*restrict df", ""),
    ]
    outs = [Output("f", 0, f, 1), Output("df", 0, ca.densify(column), 2)] if f.numel() else []
    code = emit([*ins, Input("seed", seed, 2)], outs, stages)
    return code.text, {"constants": code.kept[0], "point": code.kept[1], "values": f.numel()}
