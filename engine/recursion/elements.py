"""What the complement equations η = law(N(η)) are made of (METHOD, "Complement equations"), joint by joint.

For each joint with friction: the components of its reaction that its contact forms need, the rates of its freedoms and their
accelerations (which rest sets to zero), and its law with its numbers.
"""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from engine.contact import Wrench
from engine.contact.base import COMPONENTS, SPAN
from engine.friction import REGISTRY as LAWS
from engine.friction import Law
from engine.recursion import cuts as cutting
from engine.recursion.accelerations import Accelerations
from engine.recursion.reactions import on_pin, span
from engine.recursion.reduction import Model
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, zeros
from engine.system.elements import Element, elements
from engine.system.structure import GROUND, Joint, Signal


def reaction_rows(m: Model, acc: Accelerations, e: Element, combine: SX | None = None) -> SX:
    """The needed components of f_c, m_c of an element as affine maps (n×columns), or as numbers (n×1) with ``combine``."""
    if not e.needs:
        return SX(0, 1 if combine is not None else m.columns)
    f, t = on_pin(m, acc, e.joint, combine)
    rows = {**{f"f{k + 1}": f[k, :] for k in range(3)}, **{f"m{k + 1}": t[k, :] for k in range(3)}}
    if SPAN in e.needs:
        rows[SPAN] = span(m, e.joint, f.size2())
    return ca.sparsify(ca.vertcat(*[rows[n] for n in e.needs]))


def joint_rates(m: Model, j: Joint) -> list[SX]:
    """Rates of all freedoms of a joint, which may be one of the tree or a cut one."""
    if not j.cut:
        return m.steps[j.child].rates
    return cutting.rates(next(c for c in m.cuts if c.joint.name == j.name))


def acceleration_rows(m: Model, acc: Accelerations, j: Joint) -> SX:
    """Affine maps of the joint's accelerations q̈ (freedoms×columns), tree or cut, driven freedoms included."""
    columns = acc.Zdot[0].size2() if acc.Zdot else 1
    out = zeros(j.kind.nv, columns)
    if not j.cut:
        step = m.steps[j.child]
        for row, k in enumerate(j.free):
            out[k, :] = acc.qdd[j.child][row, :]
        for k, value in m.sym.driven_accelerations(step.joint).items():
            out[k, 0] = value
        return ca.sparsify(out)
    c = next(c for c in m.cuts if c.joint.name == j.name)
    for k in range(j.kind.nv):
        on_in, on_out = cutting.axis_wrenches(c, k)
        for body, g in ((j.inb, on_in), (j.out, on_out)):
            if body != GROUND:
                out[k, :] += g.T @ acc.Zdot[body]
        out[k, 0] += cutting.acceleration_bias(c, k)
        for body, g in ((j.inb, on_in), (j.out, on_out)):
            if body == GROUND:
                out[k, 0] += g.T @ _ground(m)
    return ca.sparsify(out)


def _ground(m: Model) -> SX:
    from engine.recursion.loads import ground_acceleration

    return ground_acceleration(m.sym)


def laws(sym: Symbols, e: Element, states: SX | None = None) -> list[Law]:
    """The law at each sliding pair of an element. ``states``: states of all laws, when others than the symbols' are to be used."""
    law, b = LAWS[e.friction.law], sym.b if states is None else states
    index = {eta: i for i, eta in enumerate(sym.system.bristles)}
    return [law(numbers(sym, e), sym.mode(s.flag), [b[index[i]] for i in s.eta if i in index]) for s in e.friction.sliders]


def bristle_rates(m: Model, acc: Accelerations, combine: SX) -> list[SX]:
    """Rates of the states of all friction laws that have some, 1/s, in the order of ``Symbols.b``."""
    out: list[SX] = []
    for e in elements(m.sym.system):
        if e.friction.bristles:
            w = wrench(e, reaction_rows(m, acc, e, combine))
            out += e.contact.drifts(w, joint_rates(m, e.joint), laws(m.sym, e), numbers(m.sym, e), e.friction.adams)
    return out


def by_loads(values: SX, e: Element, N: SX) -> SX:
    """∂values/∂N, dense, N being the element's needed components; no multiplier changes a span, so that it counts as given."""
    out = ca.densify(ca.jacobian(values, N))
    if SPAN in e.needs:
        out[:, e.needs.index(SPAN)] = 0
    return out


def numbers(sym: Symbols, e: Element) -> Mapping[str, SX]:
    """The numbers of an element (sizes and those of its law) by name, as expressions. Those that follow time or an input are
    never negative, nor is the coefficient of rest then below that of sliding."""
    out = {n: ca.fmax(sym.load(x), 0) if isinstance(x, Signal) else sym.leaf(x) for n, x in e.friction.numbers}
    if e.friction.varies and "mu_static" in out:
        out["mu_static"] = ca.fmax(out["mu_static"], out["mu"])
    return out


def wrench(e: Element, values: SX) -> Wrench:
    """The element's components, in the order of its ``needs``, as the Wrench that its forms are given."""
    assert set(e.needs) <= {*COMPONENTS, SPAN}
    return Wrench({n: values[k] for k, n in enumerate(e.needs)}, e.joint.fit.sign)
