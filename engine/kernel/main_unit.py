"""The stepping unit: prepare, stage 1 (maps), laws, stage 2 (accelerations), closure of loops, coordinate rates.

Between stage 1 and stage 2 the runtime solves for the multipliers (METHOD, "Affine maps"); nothing here depends on the mode of a
pair. Stage 1 writes one block, "maps", of matrices in column-major order. With a active cut rows, e multipliers η, n reaction
components, r rates and k scaled reactions it holds, one after the other:

  S (a×a), Se (a×e), g0 (a)      constraint equations S λ + Se η + g0 = 0
  N0 (n), Nl (n×a), Ne (n×e)     reaction components of frictional joints, N0 + Nl λ + Ne η
  rates (r)                      of the freedoms of frictional joints, and behind them the states of friction laws
  Q0 (e), Ql (e×a), Qe (e×e)     accelerations of these freedoms, which rest sets to zero; only where some law is set-valued
  κ0 (k), κl (k×a), κe (k×e)     scaled reactions, which decide what redundant loops leave open; only in the redundant variant,
                                 needed while stepping when friction depends on them
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca

from engine.joints.base import quaternion_rate
from engine.kernel.emit import Code, Input, Output, Stage, emit
from engine.kernel.looped import Looped, loops_pay
from engine.kernel.powers import coordinates_of, powers
from engine.recursion.accelerations import outward
from engine.recursion.elements import (
    Element,
    acceleration_rows,
    any_sets,
    bristle_rates,
    elements,
    joint_rates,
    laws,
    numbers,
    reaction_rows,
    wrench,
)
from engine.recursion.reduction import Model, model
from engine.recursion.redundancy import inactive_rows_couple, loop_joints, scaled_reactions
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX
from engine.system.structure import state_coordinates

CONST = "const double*restrict "
STATE = f"{CONST}x,{CONST}y,{CONST}c"
PROTOTYPES = f"void k_qdot({CONST}y,{CONST}v,double*restrict dq);"


@dataclass(frozen=True)
class Sizes:
    """Dimensions the runtime needs (names as in ``tr_kernel``)."""

    nq: int
    nv: int
    nb: int
    nx: int
    np: int
    nc: int
    nw: int
    nmaps: int
    rows: int
    active: tuple[int, ...]
    neta: int
    nn: int
    nrates: int
    nquad: int
    nkappa: int
    loop_friction: int
    coupled: int


@dataclass
class MainUnit:
    """C text and sizes of the stepping unit."""

    text: str
    sizes: Sizes
    elements: list[Element]
    operations: dict[str, int]


def inputs(sym: Symbols) -> list[Input]:
    """Stage inputs with their C names: parameters, external values, state, multipliers [λ active | η]."""
    nq, nv = sym.system.nq, sym.system.nv
    state = [Input("y", sym.q, 1), Input(f"y+{nq}", sym.v, 1), Input(f"y+{nq + nv}", sym.b, 1)]
    return [Input("p", sym.p, 0), Input("x", sym.x, 1), *state]


def active_rows(m: Model) -> tuple[int, ...]:
    """Constraint rows that are not structurally empty (in a planar loop of spatial joints most of them are)."""
    rows = []
    for k in range(m.sym.system.rows):
        if m.S[k, :].nnz() or m.Se[k, :].nnz() or m.g0[k].nnz():
            rows.append(k)
    return tuple(rows)


def main_unit(sym: Symbols, quadratures: bool, redundant: bool = False) -> MainUnit:
    """Build the unit; ``redundant``: the variant that carries all rows and the scaled reactions."""
    system, parts = sym.system, elements(sym.system)
    if loops_pay(system, quadratures):
        return _looped(sym, parts)
    m = model(sym)
    active = list(range(system.rows)) if redundant else list(active_rows(m))
    maps, nn, nrates, nkappa = _maps(m, parts, active, redundant)
    on_loops = {j.name for j in loop_joints(system)}
    loop_friction = any(e.joint.name in on_loops for e in parts)
    inactive = [k for k in range(system.rows) if k not in active]
    coupled = loop_friction and inactive_rows_couple(m, outward(m), inactive)
    rate, quads = _derivative(m, parts, quadratures)
    code = _stages(sym, maps, rate, quads, active)
    sizes = Sizes(
        system.nq, system.nv, sym.b.numel(), sym.x.shape[0], sym.p.shape[0], 0, code.kept[1],
        sum(int(v.numel()) for v in maps), system.rows, tuple(active), system.neta, nn, nrates, len(quads), nkappa,
        int(loop_friction), int(coupled),
    )
    return _complete(sym, m, parts, code, sizes)


def _stages(sym: Symbols, maps: list[SX], rate: list[SX], quads: list[SX], active: list[int]) -> Code:
    """prepare, stage 1 and stage 2, unrolled. Inactive multipliers never reach the motion: they are structurally absent from it."""
    multipliers = bool(active) or sym.system.neta > 0
    stages = [
        Stage("k_prepare", f"{CONST}p,double*restrict c", "c"),
        Stage("k_stage1", f"{STATE},double*restrict w,double*restrict maps,double*restrict dy", "w"),
        Stage("k_stage2", f"{STATE},{CONST}w,{CONST}z,double*restrict dy", ""),
    ]
    lam = ca.vertcat(SX(0, 1), *[sym.lam[k] for k in active])
    ins = [*inputs(sym), Input("z", lam, 2), Input(f"z+{len(active)}", sym.eta, 2)]
    rate = _without_inactive(sym, rate, active)
    return emit(ins, [Output("maps", 0, maps, 1), Output("dy", 0, rate + quads, 2 if multipliers else 1)], stages)


def _looped(sym: Symbols, parts: list[Element]) -> MainUnit:
    """The unit of a large tree, its recursion in loops."""
    loop = Looped(sym)
    system, nn = sym.system, sum(len(e.needs) for e in parts)
    nrates, ne = sum(e.joint.kind.nv for e in parts), system.neta
    held = ne * (1 + ne) if any_sets(system) else 0
    sizes = Sizes(
        system.nq, system.nv, 0, sym.x.shape[0], sym.p.shape[0], 0, loop.nw, nn * (1 + ne) + nrates + held + 1, 0, (), ne,
        nn, nrates, 0, 0, 0, 0,
    )
    return _complete(sym, None, parts, Code(loop.text, [loop.nc + 3, loop.nw, 0], loop.operations), sizes)


def _complete(sym: Symbols, m: Model | None, parts: list[Element], code: Code, sizes: Sizes) -> MainUnit:
    """A unit with the functions added that unrolled and looped units have in common."""
    closure = _closure(sym, m)
    laws_code = _laws(sym, parts)
    rates_code = _coordinate_rates(sym)
    stops_code = _stops(sym, m)
    codes = [code, closure, laws_code, stops_code, _held(sym, parts)]
    text = "\n".join([PROTOTYPES, *(c.text for c in codes), rates_code.text, _prepare_all(codes)])
    sizes = replace(sizes, nc=sum(c.kept[0] for c in codes))
    ops = {"prepare": code.operations[0], "stage1": code.operations[1], "stage2": code.operations[2],
           "laws": laws_code.operations[1], "closure": closure.operations[1]}
    return MainUnit(text, sizes, parts, ops)


def _without_inactive(sym: Symbols, values: list[SX], active: list[int]) -> list[SX]:
    """The same expressions with multipliers of inactive rows set to zero (they multiply structural zeros anyway)."""
    inactive = [k for k in range(sym.system.rows) if k not in active]
    if not inactive:
        return values
    old = ca.vertcat(*[sym.lam[k] for k in inactive])
    return ca.substitute(values, [old], [SX.zeros(len(inactive))])


def _maps(m: Model, parts: list[Element], active: list[int], redundant: bool) -> tuple[list[SX], int, int, int]:
    """The parts of the maps block, and how many reaction components, rates and scaled reactions it holds."""
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


def combination(sym: Symbols) -> SX:
    """The column [1; λ; η] that puts multipliers into affine maps."""
    return ca.vertcat(SX(1), sym.lam, sym.eta)


def qdot(sym: Symbols, v: SX) -> list[SX]:
    """q̇ of the state's coordinates for rates v (nv)."""
    out: list[SX] = []
    for j in sym.system.tree:
        quaternion = j.kind.quaternion
        for i in state_coordinates(j):
            if quaternion < 0 or i < quaternion:
                rate = next(k for k in range(j.kind.nv) if j.kind.coordinate_of(k) == i)
                out.append(v[j.v0 + j.free.index(rate)])
        if quaternion >= 0:
            first = j.q0 + state_coordinates(j).index(quaternion)
            spin = [v[j.v0 + j.free.index(j.kind.nv - 3 + k)] for k in range(3)]
            out += quaternion_rate([sym.q[first + i] for i in range(4)], spin)
    return out


def _derivative(m: Model, parts: list[Element], quadratures: bool) -> tuple[list[SX], list[SX]]:
    """ẏ = [q̇; v̇; rates of friction states] and the powers to be integrated beside it."""
    sym = m.sym
    pick = combination(sym)
    acc = outward(m, pick, reactions=quadratures or sym.b.numel() > 0)
    rate = [*qdot(sym, sym.v), *[a[i] for a in acc.qdd for i in range(a.numel())], *bristle_rates(m, acc, pick)]
    return rate, [p for _, p in powers(m, acc, pick)] if quadratures else []


def _closure(sym: Symbols, m: Model | None) -> Code:
    """C function of the residuals φ of all rows of cut joints, and of their rates."""
    rows = [row for c in m.cuts for row in c.rows] if m else []
    stages = [
        Stage("k_prepare_closure", f"{CONST}p,double*restrict c", "c"),
        Stage("k_closure", f"{STATE},double*restrict h", ""),
    ]
    values = [r.phi for r in rows] + [r.rate for r in rows]
    return emit(inputs(sym), [Output("h", 0, values or [SX(0, 1)], 1)], stages)


def _stops(sym: Symbols, m: Model | None) -> Code:
    """C function of the depth by which every stop is pressed, negative while it is not."""
    depths: list[SX] = [SX(0)] * sym.system.stops
    for j in sym.system.joints:
        q = [] if not j.kind.nv else coordinates_of(m, j) if m else sym.coordinates(j)
        for k, d in enumerate(j.devices):
            if d.stop is None:
                continue
            for bound, flag, sign in zip((d.stop.lower, d.stop.upper), d.stop.flags, (1, -1), strict=True):
                if bound is not None:
                    depths[flag] = sign * (sym.leaf(bound) - q[j.kind.coordinate_of(k)])
    stages = [
        Stage("k_prepare_events", f"{CONST}p,double*restrict c", "c"),
        Stage("k_events", f"{STATE},double*restrict g", ""),
    ]
    return emit(inputs(sym), [Output("g", 0, depths or [SX(0, 1)], 1)], stages)


def _laws(sym: Symbols, parts: list[Element]) -> Code:
    """η = law(N, rates), its derivative with N (dense block per element, column-major), sliding speeds and kink speeds."""
    nn = sum(len(e.needs) for e in parts)
    nr = sum(e.joint.kind.nv for e in parts)
    N, rates = SX.sym("N", nn), SX.sym("r", nr + sym.b.numel())
    eta: list[SX] = [SX(0)] * sym.system.neta
    derivative: list[SX] = []
    speeds: list[SX] = [SX(0)] * (2 * len(sym.system.sliders))
    for e in parts:
        mine, ls, g = N[e.n0 : e.n0 + len(e.needs)], laws(sym, e, rates[nr:]), numbers(sym, e)
        r = [rates[e.rate0 + k] for k in range(e.joint.kind.nv)]
        w = wrench(e, mine)
        values = ca.vertcat(*e.contact.friction(w, r, ls, g, e.friction.adams))
        for k, i in enumerate(e.eta):
            eta[i] = values[k]
        derivative.append(ca.vec(ca.densify(ca.jacobian(values, mine))))
        for s, speed, law in zip(e.friction.sliders, e.contact.speeds(w, r, ls, g, e.friction.adams), ls, strict=True):
            speeds[2 * s.flag], speeds[2 * s.flag + 1] = speed, law.kink
        if e.sets:
            cone = e.contact.cone(w, r, ls, g, e.friction.adams) if e.contact.cone else [SX(1)] * len(ls)
            for s, measure in zip(e.friction.sliders, cone, strict=True):
                speeds[2 * s.flag + 1] = measure
    args = f"{CONST}N,{CONST}r,{CONST}x,{CONST}c"
    stages = [
        Stage("k_prepare_laws", f"{CONST}p,double*restrict c", "c"),
        Stage("k_laws", f"{args},double*restrict eta,double*restrict dN,double*restrict speed", ""),
    ]
    ins = [Input("p", sym.p, 0), Input("x", sym.x, 1), Input("N", N, 1), Input("r", rates, 1)]
    outs = [Output("eta", 0, eta, 1), Output("dN", 0, derivative, 1), Output("speed", 0, speeds, 1)]
    return emit(ins, [o for o in outs if o.values], stages)


def _held(sym: Symbols, parts: list[Element]) -> Code:
    """What pairs at rest hold, 3 numbers a pair: capacity, size of the friction u and what no friction carries (see ``Hold``), and
    the derivative of the capacity by N (a row per pair, in order, of its element's components)."""
    nn = sum(len(e.needs) for e in parts)
    N, u = SX.sym("N", nn), SX.sym("u", sym.system.neta)
    values: list[SX] = [SX(0)] * (3 * len(sym.system.sliders))
    rows: list[SX] = []
    for e in parts:
        mine, found = N[e.n0 : e.n0 + len(e.needs)], []
        if e.sets:
            asked, adams = [u[i] for i in e.eta], e.friction.adams
            found = e.contact.held(wrench(e, mine), asked, laws(sym, e), numbers(sym, e), adams)
        for n, s in enumerate(e.friction.sliders):
            capacity = found[n].capacity if found else SX(0)
            if found:
                values[3 * s.flag : 3 * s.flag + 3] = [capacity, found[n].size, SX(found[n].beyond)]
            rows.append(ca.vec(ca.densify(ca.jacobian(capacity, mine))))
    stages = [
        Stage("k_prepare_held", f"{CONST}p,double*restrict c", "c"),
        Stage("k_held", f"{CONST}N,{CONST}u,{CONST}x,{CONST}c,double*restrict hold,double*restrict dN", ""),
    ]
    ins = [Input("p", sym.p, 0), Input("x", sym.x, 1), Input("N", N, 1), Input("u", u, 1)]
    return emit(ins, [o for o in (Output("hold", 0, values, 1), Output("dN", 0, rows, 1)) if o.values], stages)


def _coordinate_rates(sym: Symbols) -> Code:
    """C function of q̇ for any rates v, by which corrections of positions move along quaternions too."""
    stages = [Stage("k_unused", f"{CONST}p,double*restrict c", "c"), Stage("k_qdot", f"{CONST}y,{CONST}v,double*restrict dq", "")]
    v = SX.sym("v", sym.system.nv)
    values = qdot(sym, v)
    code = emit([Input("y", sym.q, 1), Input("v", v, 1)], [Output("dq", 0, values or [SX(0, 1)], 1)], stages)
    code.text = code.text[code.text.index("void k_qdot") :]
    return code


def _prepare_all(codes: list[Code]) -> str:
    """One function that fills the constants of all parts, and where each part's constants start."""
    names = ["k_prepare", "k_prepare_closure", "k_prepare_laws", "k_prepare_events", "k_prepare_held"]
    starts = [sum(c.kept[0] for c in codes[:i]) for i in range(len(codes))]
    calls = "".join(f"{n}(p,c+{at});" for n, at in zip(names, starts, strict=True))
    return (
        f"enum {{K_C_CLOSURE={starts[1]},K_C_LAWS={starts[2]},K_C_EVENTS={starts[3]},K_C_HELD={starts[4]}}};\n"
        f"void k_prepare_all({CONST}p,double*restrict c){{{calls}}}\n"
    )


__all__ = ["MainUnit", "Sizes", "combination", "inputs", "main_unit"]
