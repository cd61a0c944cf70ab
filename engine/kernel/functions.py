"""The functions of the stepping unit beside its stages: closure of loops, depths of stops, friction laws, what pairs at rest hold,
coordinate rates, energies; and the one that computes the constants of all."""

from __future__ import annotations

import casadi as ca

from engine.kernel.calling import CONST, STATE, inputs, qdot
from engine.kernel.emit import Code, Input, Output, Stage, emit
from engine.kernel.expressions import kinetic, potential
from engine.kernel.powers import coordinates_of
from engine.recursion import latches
from engine.recursion.elements import by_loads, joint_rates, laws, numbers, wrench
from engine.recursion.loads import stop_push
from engine.recursion.reduction import Model
from engine.recursion.springs import complete_wrench, rubbed
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX
from engine.system.elements import Element, elements


def closure_function(sym: Symbols, m: Model | None) -> Code:
    """C function of the residuals φ of all rows of cut joints, and of their rates."""
    rows = [row for c in m.cuts for row in c.rows] if m else []
    stages = [
        Stage("k_prepare_closure", f"{CONST}p,double*restrict c", "c"),
        Stage("k_closure", f"{STATE},double*restrict h", ""),
    ]
    values = [r.phi for r in rows] + [r.rate for r in rows]
    return emit(inputs(sym), [Output("h", 0, values or [SX(0, 1)], 1)], stages)


def stops_function(sym: Symbols, m: Model | None) -> Code:
    """C function of the depth by which every stop is pressed, negative while it is not; behind them how far each is from letting go
    inside its reach (``recursion/loads.py``: stop_push)."""
    depths: list[SX] = [SX(0)] * sym.system.stops
    pushes: list[SX] = [SX(1)] * sym.system.stops
    for j in sym.system.joints:
        q = [] if not j.kind.nv else coordinates_of(m, j) if m else sym.coordinates(j)
        for k, d in enumerate(j.devices):
            if d.latch is not None:
                at, (hook, _) = q[j.kind.coordinate_of(k)], sym.latch_flags(d.latch)
                found = latches.depths(sym, d.latch, hook, at, sym.load(d.latch.release))
                depths[sym.system.hook(d.latch.hook)], depths[d.latch.pressed] = found
            if d.stop is None:
                continue
            for bound, flag, sign in zip((d.stop.lower, d.stop.upper), d.stop.flags, (1, -1), strict=True):
                if bound is not None:
                    rate = (joint_rates(m, j) if m else sym.rates(j))[k]
                    depths[flag] = sign * (sym.leaf(bound) - q[j.kind.coordinate_of(k)])
                    pushes[flag] = stop_push(sym.leaf(d.stop.damping), sign, rate)
    stages = [
        Stage("k_prepare_events", f"{CONST}p,double*restrict c", "c"),
        Stage("k_events", f"{STATE},double*restrict g", ""),
    ]
    return emit(inputs(sym), [Output("g", 0, [*depths, *pushes] or [SX(0, 1)], 1)], stages)


def laws_function(sym: Symbols, parts: list[Element]) -> Code:
    """η = law(N, rates), its derivative with N (dense block per element, column-major), a ``tr_sliding`` a pair."""
    nn = sum(len(e.needs) for e in parts)
    nr = sum(e.joint.kind.nv for e in parts)
    N, rates = SX.sym("N", nn), SX.sym("r", nr + sym.b.numel())
    eta: list[SX] = [SX(0)] * sym.system.neta
    derivative: list[SX] = []
    sliding: list[SX] = [SX(0), SX(0), SX(1)] * len(sym.system.sliders)
    for e in parts:
        mine, ls, g = N[e.n0 : e.n0 + len(e.needs)], laws(sym, e, rates[nr:]), numbers(sym, e)
        r = [rates[e.rate0 + k] for k in range(e.joint.kind.nv)]
        w = wrench(e, mine)
        values = ca.vertcat(*e.contact.friction(w, r, ls, g, e.friction.adams))
        for k, i in enumerate(e.eta):
            eta[i] = values[k]
        derivative.append(ca.vec(by_loads(values, e, mine)))
        for s, speed, law in zip(e.friction.sliders, e.contact.speeds(w, r, ls, g, e.friction.adams), ls, strict=True):
            sliding[3 * s.flag], sliding[3 * s.flag + 1] = speed, law.kink
        if e.contact.cone and all(law.sets or law.kinks for law in ls):
            for s, measure in zip(e.friction.sliders, e.contact.cone(w, r, ls, g, e.friction.adams), strict=True):
                sliding[3 * s.flag + 2] = measure
    args = f"{CONST}N,{CONST}r,{CONST}x,{CONST}c"
    stages = [
        Stage("k_prepare_laws", f"{CONST}p,double*restrict c", "c"),
        Stage("k_laws", f"{args},double*restrict eta,double*restrict dN,double*restrict speed", ""),
    ]
    ins = [Input("p", sym.p, 0), Input("x", sym.x, 1), Input("N", N, 1), Input("r", rates, 1)]
    outs = [Output("eta", 0, eta, 1), Output("dN", 0, derivative, 1), Output("speed", 0, sliding, 1)]
    return _also_alone(emit(ins, [o for o in outs if o.values], stages), "k_laws", sum(d.numel() for d in derivative))


def held_function(sym: Symbols, parts: list[Element]) -> Code:
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
            rows.append(ca.vec(by_loads(capacity, e, mine)))
    stages = [
        Stage("k_prepare_held", f"{CONST}p,double*restrict c", "c"),
        Stage("k_held", f"{CONST}N,{CONST}u,{CONST}x,{CONST}c,double*restrict hold,double*restrict dN", ""),
    ]
    ins = [Input("p", sym.p, 0), Input("x", sym.x, 1), Input("N", N, 1), Input("u", u, 1)]
    outs = [o for o in (Output("hold", 0, values, 1), Output("dN", 0, rows, 1)) if o.values]
    return _also_alone(emit(ins, outs, stages), "k_held", sum(r.numel() for r in rows))


def _also_alone(code: Code, name: str, derivatives: int) -> Code:
    """The code with a second function, ``name``_alone, that has the text of the first but keeps its array of derivatives, dN, to
    itself: a compiler leaves out what only they need."""
    own = code.text[code.text.index(f"void {name}(") :].replace(f"void {name}(", f"void {name}_alone(")
    own = own.replace(",double*restrict dN", "").replace("{\n", f"{{\ndouble dN[{max(derivatives, 1)}];\n", 1)
    code.text += "\n" + own
    return code


def energy_function(sym: Symbols, m: Model | None) -> Code:
    """C function of the kinetic and the potential energy at a state, J, by which the audit looks at steps. Large trees in
    loops have none."""
    stages = [
        Stage("k_prepare_energy", f"{CONST}p,double*restrict c", "c"),
        Stage("k_energy", f"{STATE},double*restrict out", ""),
    ]
    return emit(inputs(sym), [Output("out", 0, [m.once(kinetic), m.once(potential)] if m else [SX(0, 1)], 1)], stages)


def pressed_function(sym: Symbols, parts: list[tuple[Element, int, int]]) -> Code:
    """What friction changes in the scaled reactions of joints on loops, in their order, and its derivative with N (dense block per
    element, column-major)."""
    every = elements(sym.system)
    N, rates = SX.sym("N", sum(len(e.needs) for e in every)), SX.sym("r", sum(e.joint.kind.nv for e in every) + sym.b.numel())
    nr = rates.numel() - sym.b.numel()
    values, derivative = SX(0, 1), SX(0, 1)
    for e, _, _ in parts:
        mine = N[e.n0 : e.n0 + len(e.needs)]
        r = [rates[e.rate0 + k] for k in range(e.joint.kind.nv)]
        found = rubbed(sym, e, complete_wrench(e, mine), r, laws(sym, e, rates[nr:]), numbers(sym, e))
        values = ca.vertcat(values, found)
        derivative = ca.vertcat(derivative, ca.vec(by_loads(found, e, mine)))
    stages = [
        Stage("k_prepare_pressed", f"{CONST}p,double*restrict c", "c"),
        Stage("k_pressed", f"{CONST}N,{CONST}r,{CONST}x,{CONST}c,double*restrict more,double*restrict dN", ""),
    ]
    ins = [Input("p", sym.p, 0), Input("x", sym.x, 1), Input("N", N, 1), Input("r", rates, 1)]
    outs = [Output("more", 0, ca.densify(values), 1), Output("dN", 0, derivative, 1)]
    return emit(ins, outs if values.numel() else [], stages)


def coordinate_rates_function(sym: Symbols) -> Code:
    """C function of q̇ for any rates v, by which corrections of positions move along quaternions too."""
    rates = Stage("k_qdot", f"{CONST}y,{CONST}v,{CONST}c,double*restrict dq", "")
    stages = [Stage("k_unused", f"{CONST}p,double*restrict c", "c"), rates]
    v = SX.sym("v", sym.system.nv)
    values = qdot(sym, v)
    code = emit([Input("y", sym.q, 1), Input("v", v, 1)], [Output("dq", 0, values or [SX(0, 1)], 1)], stages)
    code.text = code.text[code.text.index("void k_qdot") :]
    return code


def prepare_all(codes: list[Code]) -> str:
    """One function that fills the constants of all parts, and where each part's constants start."""
    names = [f"k_prepare{part}" for part in ("", "_closure", "_laws", "_events", "_held", "_energy", "_pressed")]
    starts = [sum(c.kept[0] for c in codes[:i]) for i in range(len(codes))]
    calls = "".join(f"{n}(p,c+{at});" for n, at in zip(names, starts, strict=True))
    places = zip(("CLOSURE", "LAWS", "EVENTS", "HELD", "ENERGY", "PRESSED"), starts[1:], strict=True)
    return (
        f"enum {{{','.join(f'K_C_{name}={at}' for name, at in places)}}};\n"
        f"void k_prepare_all(const void*scene,{CONST}p,double*restrict c){{{calls}}}\n"
    )
