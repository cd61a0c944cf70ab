"""Functions of the stepping unit outside its stages. These functions compute closure of loops, depths of end stops, friction laws,
static friction capacities, coordinate rates, energies and all constants."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from trunnion.kernel.c_code.code_generator import Code, Input, Output, emit
from trunnion.kernel.units.energy_expressions import kinetic, potential
from trunnion.kernel.units.generated_function_inputs import CONST, PREPARE, STATE, inputs, qdot, with_constants
from trunnion.kernel.units.power_expressions import coordinates_of
from trunnion.recursion import latch_forces
from trunnion.recursion.complement_equation_terms import by_loads, joint_rates, laws, numbers, wrench
from trunnion.recursion.cut_joint_constraints import INSIDE
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.loop_contact_springs import complete_wrench, friction_change
from trunnion.recursion.masses_and_forces import line_of, nonlinear_position, place_of, stop_push
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.force_curve_positions import fields_with_width, freedoms_with_curves, lines_with_curves
from trunnion.system.structure.friction_joint_indices import Element, elements


def _of_state(sym: Symbols, name: str, output: str, values: list[SX]) -> Code:
    """C text of a function of the state."""
    stages = with_constants(f"k_prepare_{name}", f"k_{name}", f"{STATE},double*restrict {output}")
    return emit(inputs(sym), [Output(output, 0, values or [SX(0, 1)], 1)], stages)


def _of_loads(sym: Symbols, name: str, N: SX, others: Sequence[Input], outputs: dict[str, list[SX]]) -> Code:
    """C text of a function of reaction components N, external values and other inputs."""
    read = ["N", *(o.name for o in others), "x", "c"]
    arguments = ",".join([*(f"{CONST}{n}" for n in read), *(f"double*restrict {n}" for n in outputs)])
    ins = [Input("p", sym.p, 0), Input("x", sym.x, 1), Input("N", N, 1), *others]
    stages = with_constants(f"k_prepare_{name}", f"k_{name}", arguments)
    return emit(ins, [Output(o, 0, values, 1) for o, values in outputs.items() if values], stages)


def closure_function(m: Model) -> Code:
    """C function of the residuals φ of all rows of cut joints, and of their rates."""
    rows = [row for c in m.cuts for row in c.rows]
    values = [r.phi for r in rows] + [r.rate for r in rows]
    return _of_state(m.sym, "closure", "h", values)


def stops_function(m: Model) -> Code:
    """C function of the depth by which every end stop is compressed. The depth of an open stop is negative. After the depths, the
    output has one more value for each stop. For an end stop, the value is the factor of the elastic force, which is 0 at release
    (``stop_push``). For a hook, the value is the excess of its signal over the release value. For a unilateral joint, the value is
    the coefficient of restitution. The positions in curves and fields come last (``system.structure.force_curve_positions``)."""
    sym = m.sym
    depths: list[SX] = [SX(0)] * sym.system.stops
    pushes: list[SX] = [SX(1)] * sym.system.stops
    for c in m.cuts:
        if c.joint.unilateral is not None:
            flag, inside = c.joint.unilateral.flag, c.joint.unilateral.inside
            depths[flag], pushes[flag] = -c.rows[0].phi, sym.leaf(c.joint.unilateral.restitution)
            if inside >= 0:
                depths[inside] = c.made[INSIDE]
    for j in sym.system.joints:
        q = coordinates_of(m, j) if j.kind.nv else []
        for k, d in enumerate(j.devices):
            if d.latch is not None:
                at, (hook, _) = q[j.kind.coordinate_of(k)], sym.latch_flags(d.latch)
                found = latch_forces.depths(sym, d.latch, hook, at, sym.load(d.latch.release))
                depths[sym.system.hook(d.latch.hook)], depths[d.latch.pressed], pushes[sym.system.hook(d.latch.hook)] = found
            if d.stop is None:
                continue
            for bound, flag, sign in zip((d.stop.lower, d.stop.upper), d.stop.flags, (1, -1), strict=True):
                if bound is not None:
                    rate = joint_rates(m, j)[k]
                    depths[flag] = sign * (sym.leaf(bound) - q[j.kind.coordinate_of(k)])
                    pushes[flag] = stop_push(sym.leaf(d.stop.damping), sign, rate)
    return _of_state(sym, "events", "g", [*depths, *pushes, *_curve_positions(m)])


def _curve_positions(m: Model) -> list[SX]:
    """The positions in curves and fields."""
    sym, found = m.sym, []
    for j, k, law in freedoms_with_curves(sym.system):
        i = j.kind.coordinate_of(k)
        found.append(nonlinear_position(sym, law, coordinates_of(m, j)[i] if i >= 0 else SX(0), joint_rates(m, j)[k]))
    for load, law in lines_with_curves(sym.system):
        line = line_of(sym, m.motions, load)
        found.append(nonlinear_position(sym, law, line.length, line.rate))
    for load in fields_with_width(sym.system):
        found += ca.vertsplit(place_of(sym, m.motions, load) / sym.leaf(load.numbers[0]))
    return found


def laws_function(sym: Symbols, parts: list[Element]) -> Code:
    """C function of η = law(N, rates), and of a ``tr_sliding`` for each pair. Also computes the derivative of η by N (a dense block
    for each element, column-major)."""
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
    code = _of_loads(sym, "laws", N, [Input("r", rates, 1)], {"eta": eta, "dN": derivative, "speed": sliding})
    return _also_alone(code, "k_laws", sum(d.numel() for d in derivative))


def held_function(sym: Symbols, parts: list[Element]) -> Code:
    """C function of a ``tr_hold`` for each friction pair, and of the derivative of the capacities by N. The derivative has a row
    for each pair, over the components of the pair's element."""
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
    code = _of_loads(sym, "held", N, [Input("u", u, 1)], {"hold": values, "dN": rows})
    return _also_alone(code, "k_held", sum(r.numel() for r in rows))


def _also_alone(code: Code, name: str, derivatives: int) -> Code:
    """The code with a second function, ``name``_alone, without the derivatives dN. The second function has the same text, with a
    local array dN. The compiler removes computations that only dN needs."""
    own = code.text[code.text.index(f"void {name}(") :].replace(f"void {name}(", f"void {name}_alone(")
    own = own.replace(",double*restrict dN", "").replace("{\n", f"{{\ndouble dN[{max(derivatives, 1)}];\n", 1)
    code.text += "\n" + own
    return code


def energy_function(m: Model) -> Code:
    """C function of the kinetic and the potential energy of a state, J, for the audit."""
    return _of_state(m.sym, "energy", "out", [m.once(kinetic), m.once(potential)])


def pressed_function(sym: Symbols, parts: list[tuple[Element, int, int]]) -> Code:
    """C function of the change of the scaled reactions of joints in loops by friction η = u. Also the derivatives of this change by
    N and by η (dense blocks for each element, column-major)."""
    every = elements(sym.system)
    N, rates = SX.sym("N", sum(len(e.needs) for e in every)), SX.sym("r", sum(e.joint.kind.nv for e in every) + sym.b.numel())
    u = SX.sym("u", sym.system.neta)
    nr = rates.numel() - sym.b.numel()
    values: list[SX] = []
    derivative: list[SX] = []
    for e, _, _ in parts:
        mine = N[e.n0 : e.n0 + len(e.needs)]
        r = [rates[e.rate0 + k] for k in range(e.joint.kind.nv)]
        eta = ca.vertcat(*[u[i] for i in e.eta])
        found = friction_change(sym, e, complete_wrench(e, mine), r, laws(sym, e, rates[nr:]), numbers(sym, e), ca.vertsplit(eta))
        values.append(ca.densify(found))
        derivative += [ca.vec(by_loads(found, e, mine)), ca.vec(ca.densify(ca.jacobian(found, eta)))]
    return _of_loads(sym, "pressed", N, [Input("r", rates, 1), Input("u", u, 1)], {"more": values, "dN": derivative})


def coordinate_rates_function(sym: Symbols) -> Code:
    """C function of q̇ for any rates v. Corrections of positions use this function for quaternions."""
    stages = with_constants("k_unused", "k_qdot", f"{CONST}y,{CONST}v,{CONST}c,double*restrict dq")
    v = SX.sym("v", sym.system.nv)
    values = qdot(sym, v)
    code = emit([Input("y", sym.q, 1), Input("v", v, 1)], [Output("dq", 0, values or [SX(0, 1)], 1)], stages)
    code.text = code.text[code.text.index("void k_qdot") :]
    return code


def prepare_all(codes: list[Code]) -> str:
    """C text of a function that computes the constants of all functions; also the offsets of these constants."""
    names = [f"k_prepare{part}" for part in ("", "_closure", "_laws", "_events", "_held", "_energy", "_pressed")]
    starts = [sum(c.kept[0] for c in codes[:i]) for i in range(len(codes))]
    calls = "".join(f"{n}(p,c+{at});" for n, at in zip(names, starts, strict=True))
    places = zip(("CLOSURE", "LAWS", "EVENTS", "HELD", "ENERGY", "PRESSED"), starts[1:], strict=True)
    return (
        f"enum {{{','.join(f'K_C_{name}={at}' for name, at in places)}}};\n"
        f"void k_prepare_all({PREPARE}){{{calls}}}\n"
    )
