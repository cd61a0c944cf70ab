"""Contacts of the joints on loops as springs, those of a joint all of one radial stiffness, a face across its axis the same
(METHOD, "Redundant loops").

The rows are what the contacts press, each a force over the root of its spring's stiffness; their sum of squares is the elastic
energy but for a factor. A joint without friction counts as one whose contacts are a part of its parts' radius of gyration apart.
"""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from engine.contact import ContactElement, Wrench
from engine.contact.base import COMPONENTS, SPAN
from engine.contact.journal import HALF_ROOT
from engine.recursion.accelerations import Accelerations
from engine.recursion.elements import joint_rates, laws, numbers
from engine.recursion.reactions import frames, lengths, on_outboard, overlap, pinned
from engine.recursion.reduction import Model
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, cross
from engine.system.elements import Element
from engine.system.loops import NO_SIZE, USUAL, contact_of
from engine.system.structure import GROUND, Body, Joint, Signal

PART = 0.1
"""Half length of the contacts of a joint without friction, of the radius of gyration of its parts."""


def contact_rows(m: Model, acc: Accelerations, j: Joint, pick: SX | None = None) -> SX:
    """What a joint's springs carry, friction counted as any other force: affine maps (rows×columns), or numbers (rows×1) with
    ``pick`` = [1; λ; η]."""
    return spring_rows(m.sym, j, *on_outboard(m, acc, j, pick), *frames(m, j), _arm(m, j))


def spring_rows(sym: Symbols, j: Joint, f: SX, t: SX, s: SX, Ein: SX, Eout: SX, arm: SX) -> SX:
    """The same from force and torque on the outboard part (3×columns each) at p_out, s, the joint's frames and its arm."""
    element = contact_of(j)
    drives = [_along(j, k, f, t, Ein, Eout, arm) / arm for k in j.driven]
    if element is None:
        rows = ca.vertcat(HALF_ROOT * (Ein.T @ f), HALF_ROOT / arm * (Ein.T @ (t + cross(s, f))))
        return ca.sparsify(ca.vertcat(_softened(sym, j, rows), *drives))
    unit = SX.sym("unit", 6)
    both = lengths(sym, j)
    span = {} if both is None else {SPAN: overlap(s, Ein, both)[1]}
    w = Wrench({n: unit[k] for k, n in enumerate(COMPONENTS)} | span, j.fit.sign)
    pressed = ca.vertcat(*element.pressed(w, [], [], _sizes(sym, j, element, arm)), *[w[n] for n in element.thrusts])
    map_ = ca.sparsify(ca.jacobian(pressed, unit))
    return ca.sparsify(ca.vertcat(_softened(sym, j, map_ @ ca.vertcat(*pinned(j, f, t, s, Ein, Eout, both))), *drives))


def _softened(sym: Symbols, j: Joint, rows: SX) -> SX:
    """Forces of a joint's contacts as rows: over the root of its stiffness, as they are where it says none."""
    return rows if j.stiffness is None else ca.sqrt(USUAL / sym.leaf(j.stiffness)) * rows


def rubbing_rows(m: Model, e: Element, values: SX) -> SX:
    """What the friction of sliding changes in the first rows of a joint (rows×1), its needed components of f_c, m_c given."""
    return rubbed(m.sym, e, complete_wrench(e, values), joint_rates(m, e.joint), laws(m.sym, e), numbers(m.sym, e))


def complete_wrench(e: Element, values: SX) -> Wrench:
    """A wrench of all six components from those an element needs; friction changes nothing in what the others press."""
    have = dict(zip(e.needs, [values[k] for k in range(values.numel())], strict=True))
    return Wrench({n: have.get(n, SX(0)) for n in (*COMPONENTS, *e.needs)}, e.joint.fit.sign)


def rubbed(sym: Symbols, e: Element, w: Wrench, rates: list[SX], ls: list, g: Mapping[str, SX]) -> SX:
    """The same with everything given. With Adams' friction, which knows no contacts, none."""
    without = e.contact.pressed(w, rates, [], g)
    if e.friction.adams:
        return SX.zeros(len(without))
    with_ = e.contact.pressed(w, rates, ls, g)
    return _softened(sym, e.joint, ca.vertcat(*[a - b for a, b in zip(with_, without, strict=True)]))


def _sizes(sym: Symbols, j: Joint, element: ContactElement, arm: SX) -> Mapping[str, SX]:
    """A joint's own sizes, or those of one without friction."""
    own = {n: sym.leaf(x) for n, x in j.friction.numbers if not isinstance(x, Signal)} if j.friction else {}
    if all(label in own for s in element.sizes if s.needed and s.bears and not s.ends for label in s.labels):
        return own
    return {label: arm for s in element.sizes for label in s.labels}


def _arm(m: Model, j: Joint) -> SX:
    """Half length of the contacts of a joint without friction, m."""
    bodies = [m.sym.system.bodies[b] for b in (j.out, j.inb) if b != GROUND]
    square = sum((spin(m, b) / m.sym.leaf(b.mass) for b in bodies), SX(0)) / len(bodies)
    return PART * ca.sqrt(square + NO_SIZE)


def spin(m: Model, b: Body) -> SX:
    """Half the trace of a body's inertia, kg m²; of a point mass m |c|², c being its distance from its joint, or, if none, from
    the others."""
    j = [m.sym.leaf(x) for x in b.inertia[:3]]
    mass, c = m.sym.leaf(b.mass), m.sym.leaves(b.center)
    if all(x.is_zero() for x in j):
        square = ca.dot(c, c)
        return mass * ((square if not square.is_zero() else _spread(m, b)) + NO_SIZE)
    total = 0.5 * (j[0] + j[1] + j[2])
    return total * mass if b.per_mass else total


def _spread(m: Model, b: Body) -> SX:
    """Sum of squares of the distances, m², of a body's joints from its reference origin."""
    own = m.sym.system.bodies.index(b)
    points = [p for j in m.sym.system.joints for p, body in ((j.inb_point, j.inb), (j.out_point, j.out)) if body == own]
    return sum((ca.dot(p, p) for p in map(m.sym.leaves, points)), SX(0))


def _along(j: Joint, k: int, f: SX, t: SX, Ein: SX, Eout: SX, arm: SX) -> SX:
    """What acts along a driven freedom on the outboard part: force times the arm, or torque."""
    axis = j.kind.axes[k][0]
    direction = (Ein if axis.side == "in" else Eout)[:, axis.index]
    return direction.T @ t if axis.rot else direction.T @ f * arm
