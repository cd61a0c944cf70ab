"""Terms of the complement equations η = law(N(η)) (theory, "Complement equations"), joint by joint.

The terms of a joint with friction are: reaction components that the contact forms need, rates and accelerations of the freedoms,
and the friction law with its parameters."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact import Wrench
from trunnion.elements.contact.contact_element import COMPONENTS, SPAN
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.friction import Law
from trunnion.recursion import cut_joint_constraints as cutting
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.joint_reactions import by_component, on_pin, span
from trunnion.recursion.masses_and_forces import ground_acceleration
from trunnion.recursion.outward_accelerations import Accelerations
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, zeros
from trunnion.system.structure.bodies_and_joints import GROUND, Joint, Signal
from trunnion.system.structure.friction_joint_indices import Element, elements


def reaction_rows(m: Model, acc: Accelerations, e: Element, combine: SX | None = None) -> SX:
    """The components of f_c, m_c that an element needs, as affine maps (n×columns); with ``combine``, as values (n×1)."""
    if not e.needs:
        return SX(0, 1 if combine is not None else m.columns)
    f, t = on_pin(m, acc, e.joint, combine)
    rows = by_component(f, t)
    if SPAN in e.needs:
        rows[SPAN] = span(m, e.joint, f.size2())
    return ca.sparsify(ca.vertcat(*[rows[n] for n in e.needs]))


def joint_rates(m: Model, j: Joint) -> list[SX]:
    """Rates of all freedoms of a tree or cut joint."""
    return cutting.rates(m.cut(j)) if j.cut else m.steps[j.child].rates


def acceleration_rows(m: Model, acc: Accelerations, j: Joint) -> SX:
    """Affine maps (freedoms×columns) of the accelerations q̈ of all freedoms of a joint, including driven freedoms."""
    columns = acc.Zdot[0].size2() if acc.Zdot else 1
    out = zeros(j.kind.nv, columns)
    if not j.cut:
        step = m.steps[j.child]
        for row, k in enumerate(j.free):
            out[k, :] = acc.qdd[j.child][row, :]
        for k, value in m.sym.driven_accelerations(step.joint).items():
            out[k, 0] = value
        return ca.sparsify(out)
    c = m.cut(j)
    for k in range(j.kind.nv):
        sides = list(zip((j.inb, j.out), cutting.axis_wrenches(c, k), strict=True))
        for body, g in sides:
            if body != GROUND:
                out[k, :] += g.T @ acc.Zdot[body]
        out[k, 0] += cutting.acceleration_bias(c, k)
        for body, g in sides:
            if body == GROUND:
                out[k, 0] += g.T @ ground_acceleration(m.sym)
    return ca.sparsify(out)


def laws(sym: Symbols, e: Element, states: SX | None = None) -> list[Law]:
    """The law of each friction pair of an element. states: bristle states of all laws; by default ``sym.b``."""
    law, b = LAWS[e.friction.law], sym.b if states is None else states
    index = {eta: i for i, eta in enumerate(sym.system.bristles)}
    return [law(numbers(sym, e), sym.mode(s.flag), [b[index[i]] for i in s.eta if i in index]) for s in e.friction.sliders]


@dataclass
class FrictionTerms:
    """Friction of a joint: the element, the law of each friction pair, and the parameters of element and law by name."""

    element: Element
    laws: list[Law]
    numbers: Mapping[str, SX]


def friction_terms(sym: Symbols, e: Element) -> FrictionTerms:
    """The element, laws and parameters of a joint with friction."""
    return FrictionTerms(e, laws(sym, e), numbers(sym, e))


def bristle_rates(m: Model, acc: Accelerations, combine: SX) -> list[SX]:
    """Rates of all bristle states, 1/s, in the order of ``Symbols.b``."""
    out: list[SX] = []
    for e in elements(m.sym.system):
        if e.friction.bristles:
            w = wrench(e, reaction_rows(m, acc, e, combine))
            out += e.contact.drifts(w, joint_rates(m, e.joint), laws(m.sym, e), numbers(m.sym, e), e.friction.adams)
    return out


def by_loads(values: SX, e: Element, N: SX) -> SX:
    """Dense derivative ∂values/∂N. N: the components that the element needs. The derivative by a span (``SPAN``) is 0, because a
    span does not depend on the multipliers."""
    out = ca.densify(ca.jacobian(values, N))
    if SPAN in e.needs:
        out[:, e.needs.index(SPAN)] = 0
    return out


def numbers(sym: Symbols, e: Element) -> Mapping[str, SX]:
    """Parameters of an element (sizes, law) by name. A parameter that depends on time or on an input is limited to values ≥ 0. In
    an element with such a parameter, mu_static is at least mu."""
    out = {n: ca.fmax(sym.load(x), 0) if isinstance(x, Signal) else sym.leaf(x) for n, x in e.friction.numbers}
    if e.friction.varies and "mu_static" in out:
        out["mu_static"] = ca.fmax(out["mu_static"], out["mu"])
    return out


def wrench(e: Element, values: SX) -> Wrench:
    """The ``Wrench`` of an element. values: the components that the element needs, in the order of ``needs``."""
    assert set(e.needs) <= {*COMPONENTS, SPAN}
    return Wrench({n: values[k] for k, n in enumerate(e.needs)}, e.joint.fit.sign)
