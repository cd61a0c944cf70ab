"""Contacts of joints in loops as springs (theory, "Redundant loops").

All contacts of a joint have the same radial stiffness; an end face has this stiffness along the axis. Each row is a contact force
divided by the square root of the contact's stiffness. The sum of the squared rows is therefore proportional to the elastic energy.
A joint without friction has no contact sizes; its contacts get an arm that is a fraction of the distances between joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca

from trunnion.elements.contact import ContactElement, Wrench
from trunnion.elements.contact.contact_element import COMPONENTS, SPAN
from trunnion.elements.contact.journal import HALF_ROOT
from trunnion.recursion.complement_equation_terms import joint_rates, laws, numbers
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.joint_reactions import lengths, on_pin_part, overlap
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross
from trunnion.system.structure.bodies_and_joints import GROUND, Body, Joint, Signal
from trunnion.system.structure.friction_joint_indices import Element
from trunnion.system.structure.loop_joints import NO_SIZE, USUAL, contact_of, with_centres
from trunnion.system.structure.parameter_table import Leaves

PART = 0.1
"""Arm of the contacts of a joint without friction (``contact_arm``), divided by the size of the joint's block."""


def spring_rows(sym: Symbols, j: Joint, f: SX, t: SX, s: SX, Ein: SX, Eout: SX, arm: SX) -> SX:
    """Spring forces of a joint. f, t: force and torque on the outboard part at p_out (3×columns each). s, Ein, Eout: see ``Pose``.
    arm: the result of ``contact_arm``."""
    element = contact_of(j)
    drives = [_along(j, k, f, t, Ein, Eout, arm) / arm for k in j.driven]
    if element is None:
        rows = ca.vertcat(HALF_ROOT * (Ein.T @ f), HALF_ROOT / arm * (Ein.T @ (t + cross(s, f))))
        return ca.sparsify(ca.vertcat(_by_stiffness(sym, j, rows), *drives))
    unit = SX.sym("unit", 6)
    both = lengths(sym, j)
    span = {} if both is None else {SPAN: overlap(s, Ein, both)[1]}
    w = Wrench({n: unit[k] for k, n in enumerate(COMPONENTS)} | span, j.fit.sign)
    pressed = ca.vertcat(*element.pressed(w, [], [], _sizes(sym, j, element, arm), []), *[w[n] for n in element.thrusts])
    map_ = ca.sparsify(ca.jacobian(pressed, unit))
    return ca.sparsify(ca.vertcat(_by_stiffness(sym, j, map_ @ ca.vertcat(*on_pin_part(j, f, t, s, Ein, Eout, both))), *drives))


def _by_stiffness(sym: Symbols, j: Joint, rows: SX) -> SX:
    """The rows divided by √(k/USUAL), where k is the joint's stiffness. k = USUAL if the scene gives no stiffness."""
    return rows if j.stiffness is None else ca.sqrt(USUAL / sym.leaf(j.stiffness)) * rows


def friction_change_rows(m: Model, e: Element, values: SX, sliding: bool = False) -> SX:
    """Change of a joint's first spring rows (those of contacts) due to friction (rows×1). values: the components of f_c, m_c that
    the element needs. sliding: whether to omit friction at rest."""
    eta = [] if sliding else [m.sym.eta[i] for i in e.eta]
    return friction_change(m.sym, e, complete_wrench(e, values), joint_rates(m, e.joint), laws(m.sym, e), numbers(m.sym, e), eta)


def complete_wrench(e: Element, values: SX) -> Wrench:
    """A wrench with all six components. Components that the element does not need are 0."""
    have = dict(zip(e.needs, [values[k] for k in range(values.numel())], strict=True))
    return Wrench({n: have.get(n, SX(0)) for n in (*COMPONENTS, *e.needs)}, e.joint.fit.sign)


def friction_change(sym: Symbols, e: Element, w: Wrench, rates: list[SX], ls: list, g: Mapping[str, SX], eta: list[SX]) -> SX:
    """Change of the contact rows due to the friction η. The change is 0 for Adams' friction, which has no contacts."""
    without = e.contact.pressed(w, rates, [], g, [])
    if e.friction.adams:
        return SX.zeros(len(without))
    with_ = e.contact.pressed(w, rates, ls, g, eta)
    return _by_stiffness(sym, e.joint, ca.vertcat(*[a - b for a, b in zip(with_, without, strict=True)]))


def _sizes(sym: Symbols, j: Joint, element: ContactElement, arm: SX) -> Mapping[str, SX]:
    """The joint's own sizes, if it has all sizes that the element needs; otherwise ``arm`` for every size."""
    own = {n: sym.leaf(x) for n, x in j.friction.numbers if not isinstance(x, Signal)} if j.friction else {}
    if all(label in own for s in element.sizes if s.needed and s.bears and not s.ends for label in s.labels):
        return own
    return {label: arm for s in element.sizes for label in s.labels}


def contact_arm(m: Model, j: Joint, points: Mapping[int, Sequence[Leaves]]) -> SX:
    """Half the length of the contacts of a joint without friction, m (``arm_of``). points: the joint points of its block, by
    body."""
    bodies = [m.sym.system.bodies[b] for b in (j.out, j.inb) if b != GROUND]
    sizes = block_size(m.sym, points), block_size(m.sym, with_centres(m.sym.system, points))
    return arm_of(*sizes, [spin(m, b) for b in bodies], [m.sym.leaf(b.mass) for b in bodies])


def arm_of(size: SX, wide: SX, spins: Sequence[SX], masses: Sequence[SX]) -> SX:
    """PART times the size of the joint's block, m. size, wide: square of the block's size, m², without and with mass centres; the
    first of these values above 0 counts. If both are 0, the radius of gyration of the joint's parts replaces the size."""
    square = sum((j / m for j, m in zip(spins, masses, strict=True)), SX(0)) / len(masses)
    return PART * ca.sqrt(ca.if_else(size > NO_SIZE, size, ca.if_else(wide > NO_SIZE, wide, square + NO_SIZE)))


def block_size(sym: Symbols, points: Mapping[int, Sequence[Leaves]]) -> SX:
    """Mean square of the distances of points from the mean point of their body, m². Masses, frames, and the choice of the cut joint
    do not affect the result."""
    total, count = SX(0), 0
    for own in (list(map(sym.leaves, x)) for x in points.values()):
        middle = sum(own, SX(3, 1)) / len(own)
        total += sum(ca.dot(p - middle, p - middle) for p in own)
        count += len(own)
    return ca.sparsify(total) / count


def spin(m: Model, b: Body) -> SX:
    """Half the trace of a body's inertia, kg m². For a point mass, the result is the mass times the squared distance of the mass
    centre from the reference origin. If this distance is also 0, ``_spread`` replaces the squared distance."""
    j = [m.sym.leaf(x) for x in b.inertia[:3]]
    mass, c = m.sym.leaf(b.mass), m.sym.leaves(b.center)
    if all(x.is_zero() for x in j):
        square = ca.dot(c, c)
        return mass * ((square if not square.is_zero() else _spread(m, b)) + NO_SIZE)
    total = 0.5 * (j[0] + j[1] + j[2])
    return total * mass if b.per_mass else total


def _spread(m: Model, b: Body) -> SX:
    """Sum of the squared distances of a body's joints from the body's reference origin, m²."""
    own = m.sym.system.bodies.index(b)
    points = [p for j in m.sym.system.joints for p, body in ((j.inb_point, j.inb), (j.out_point, j.out)) if body == own]
    return sum((ca.dot(p, p) for p in map(m.sym.leaves, points)), SX(0))


def _along(j: Joint, k: int, f: SX, t: SX, Ein: SX, Eout: SX, arm: SX) -> SX:
    """Load along a driven freedom k on the outboard part: force times arm for a translation, torque for a rotation."""
    axis = j.kind.axes[k][0]
    direction = (Ein if axis.side == "in" else Eout)[:, axis.index]
    return direction.T @ t if axis.rot else direction.T @ f * arm
