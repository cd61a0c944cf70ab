"""Expressions of what users ask for: joint coordinates, reactions, contacts in their frames, energies, reactions in loops."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from engine.contact.base import Contact
from engine.kernel.powers import coordinates_of, drive_effort
from engine.recursion import latches
from engine.recursion.accelerations import Accelerations
from engine.recursion.bushings import bushing
from engine.recursion.elements import acceleration_rows, joint_rates, laws, numbers, reaction_rows, wrench
from engine.recursion.loads import spring_line
from engine.recursion.reactions import frames, on_inboard, pin_frame
from engine.recursion.reduction import Model
from engine.recursion.vectors import SX
from engine.system.elements import elements, everything
from engine.system.structure import Joint

TINY = 1e-300
TOUCHING = 1e-140
"""N: a contact with less is open."""


def joint(m: Model, name: str) -> Joint:
    """The joint of this name."""
    return next(j for j in m.sym.system.joints if j.name == name)


def coordinates(m: Model, name: str) -> list[SX]:
    """All coordinates of a joint of the tree or a cut one."""
    return coordinates_of(m, joint(m, name))


def rates(m: Model, name: str) -> list[SX]:
    """All rates of a joint."""
    return joint_rates(m, joint(m, name))


def accelerations(m: Model, acc: Accelerations, name: str) -> SX:
    """All accelerations of a joint."""
    return acceleration_rows(m, acc, joint(m, name))


def reaction(m: Model, acc: Accelerations, name: str, pick: SX) -> tuple[SX, SX]:
    """Total reaction on the inboard part at the joint centre, inboard joint frame."""
    return on_inboard(m, acc, joint(m, name), pick)


def drive(m: Model, acc: Accelerations, pick: SX, name: str, k: int) -> SX:
    """Effort of a drive on the outboard part."""
    return drive_effort(m, acc, pick, joint(m, name), k)


def eta_of(m: Model, name: str) -> list[int]:
    """Multiplier indices of a frictional joint, one a freedom."""
    j = joint(m, name)
    assert j.friction is not None
    return list(j.friction.eta)


def angle(y: SX, x: SX) -> SX:
    """atan2(y, x), but 0 at the origin, where the derivatives of atan2 are not numbers."""
    none = x * x + y * y <= TINY
    return ca.if_else(none, 0, ca.atan2(y, ca.if_else(none, 1, x)))


@dataclass
class Touch:
    """A contact ready for output: force, vector and plane of its angle (pin's frame; ball: inboard joint frame), unit normal in the
    inboard joint frame, elevation out of the plane, vector of which a passage through zero is noticed."""

    force: SX
    vector: tuple[SX, SX, SX]
    plane: tuple[int, int]
    normal: SX
    elevation: SX
    watched: tuple[SX, SX, SX]


def contacts(m: Model, acc: Accelerations, pick: SX, name: str) -> list[Touch]:
    """Contacts of a frictional joint by its closed forms."""
    e = next(e for e in elements(m.sym.system) if e.joint.name == name)
    w = wrench(e, _all_components(m, acc, e, pick))
    found = e.contact.contacts(w, joint_rates(m, e.joint), laws(m.sym, e), numbers(m.sym, e), [m.sym.eta[i] for i in e.eta])
    return touches(found, ca.sparsify(frames(m, e.joint)[0].T @ pin_frame(m, e.joint)))


def touches(found: list[Contact], turn: SX) -> list[Touch]:
    """Contacts made ready; turn: from the pin's frame into the inboard joint frame (3×3)."""
    out = []
    for c in found:
        vector = turn @ ca.vertcat(*c.vector)
        normal = vector / ca.sqrt(ca.dot(vector, vector) + TINY)
        elevation = ca.asin(ca.fmin(1, ca.fmax(-1, normal[3 - c.plane[0] - c.plane[1]])))
        own = (vector[0], vector[1], vector[2]) if c.inboard else c.vector
        out.append(Touch(c.force, own, c.plane, normal, elevation, c.watched or own))
    return out


def oriented(c: Touch) -> tuple[SX, SX, SX]:
    """The components of what is watched of a contact in the order (cosine axis, sine axis, third), so that its angle is
    atan2(second, first)."""
    axis, base = c.plane
    return c.watched[axis], c.watched[base], c.watched[3 - axis - base]


def _all_components(m: Model, acc: Accelerations, e, pick: SX) -> SX:
    """All six components of f_c, m_c: contacts are always those of the exact forms, whichever form friction takes."""
    e.needs = everything(e.joint)
    return reaction_rows(m, acc, e, pick)


def kinetic(m: Model) -> SX:
    """Kinetic energy Σ ½ Zᵀ M Z, and that of rotors."""
    total = SX(0)
    for mass, motion in zip(m.masses, m.motions, strict=True):
        p = mass.M11 @ motion.rdot + mass.M12 @ motion.omega
        total += 0.5 * (ca.dot(motion.rdot, p) + ca.dot(motion.omega, mass.M12.T @ motion.rdot + mass.M22 @ motion.omega))
    for step in m.steps:
        for d, rate in zip(step.joint.devices, step.rates, strict=True):
            if d.inertia is not None:
                total += 0.5 * m.sym.leaf(d.inertia) * rate**2
    return total


def potential(m: Model) -> SX:
    """Potential energy of gravity (zero at the world's origin), joint springs, engaged stops, springs between points,
    bushings."""
    sym = m.sym
    g = sym.leaves(sym.system.gravity)
    total = SX(0)
    for b, motion in zip(sym.system.bodies, m.motions, strict=True):
        total -= sym.leaf(b.mass) * ca.dot(g, motion.r + motion.R @ sym.leaves(b.center))
    for j in sym.system.joints:
        q = coordinates_of(m, j) if j.kind.nv else []
        for k, d in enumerate(j.devices):
            i = j.kind.coordinate_of(k)
            if d.spring is not None and i >= 0:
                total += 0.5 * sym.leaf(d.spring[0]) * (q[i] - sym.leaf(d.spring[1])) ** 2
            if d.latch is not None and i >= 0:
                total += latches.potential(sym, d.latch, sym.latch_flags(d.latch), q[i])
            if d.stop is not None and i >= 0:
                for bound, flag in zip((d.stop.lower, d.stop.upper), d.stop.flags, strict=True):
                    if bound is not None:
                        total += 0.5 * sym.leaf(d.stop.stiffness) * sym.stop_flag(flag) * (sym.leaf(bound) - q[i]) ** 2
    for load in sym.system.loads:
        if load.kind == "spring_damper":
            length = spring_line(sym, m.motions, load)[0]
            total += 0.5 * sym.leaf(load.numbers[0]) * (length - sym.leaf(load.numbers[2])) ** 2
        if load.kind == "bushing":
            total += bushing(sym, m.motions, load).potential
    return total
