"""Masses (16), velocity-dependent forces (17), applied forces F^a, and forces of devices along freedoms.

Gravity is modelled as an acceleration −g of the ground (Ż_0), which saves a force on each body and gives the same reactions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.recursion import latch_forces
from trunnion.recursion.body_kinematics import Motion, Step, motions_of, point_motion
from trunnion.recursion.bushing_forces import bushing, wrenches_of
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross, rotate_inertia, skew, vector, zeros
from trunnion.scene.force_laws.registry import REGISTRY as FORCE_LAWS
from trunnion.scene.signals.time_formulas import computed, operate
from trunnion.system.structure.bodies_and_joints import GROUND, Body, Device, Joint, LawForce, Load, Motor, Signal

TINY = 1e-300
Motions = Sequence[Motion] | Mapping[int, Motion]
"""The motion of each body, by body index."""


@dataclass
class Mass:
    """Mass matrix M = [M11 M12; M12ᵀ M22] of a body about its reference origin, in the world (3×3 blocks). m: mass, kg."""

    m: SX
    M11: SX
    M12: SX
    M22: SX


def mass_matrix(sym: Symbols, b: Body, R: SX) -> Mass:
    """Mass matrix of a body (16): M11 = m E, M12 = −m ρ̃, M22 = J about the reference origin. R: orientation of the body (3×3)."""
    m, c = sym.leaf(b.mass), sym.leaves(b.center)
    j = [sym.leaf(x) * m if b.per_mass else sym.leaf(x) for x in b.inertia]
    cc = [c[k] * c[k] for k in range(3)]
    steiner = [cc[1] + cc[2], cc[0] + cc[2], cc[0] + cc[1], -c[0] * c[1], -c[0] * c[2], -c[1] * c[2]]
    origin = [j[k] + m * steiner[k] for k in range(6)]
    return Mass(m, m * SX.eye(3), -skew(ca.sparsify(R @ (m * c))), rotate_inertia(R, origin))


def velocity_force(mass: Mass, omega: SX) -> SX:
    """F⁰ (17) = [−ω × (ω × m ρ); −ω × M22 ω], 6×1. The first moment m ρ is taken from M12 = −m ρ̃."""
    first = -ca.sparsify(ca.vertcat(mass.M12[2, 1], mass.M12[0, 2], mass.M12[1, 0]))
    return ca.sparsify(-ca.vertcat(cross(omega, cross(omega, first)), cross(omega, mass.M22 @ omega)))


def ground_acceleration(sym: Symbols) -> SX:
    """Ż_0 = [−g; 0], 6×1: gravity modelled as an acceleration of the ground."""
    return ca.sparsify(ca.vertcat(-sym.leaves(sym.system.gravity), zeros(3)))


def applied(sym: Symbols, motions: Motions) -> list[SX]:
    """F^a of every body at its reference origin (6×1 each): forces, torques, spring-dampers, bushings."""
    out = [zeros(6) for _ in sym.system.bodies]
    for load in sym.system.loads:
        for body, wrench in wrenches(sym, motions, load):
            out[body] = out[body] + wrench
    return out


def wrenches(sym: Symbols, motions: Motions, load: Load) -> list[tuple[int, SX]]:
    """A pair (body, wrench) for each body on which a load acts, except the ground. The wrench (6×1) is at the body's reference
    origin."""
    if load.kind == "spring_damper":
        return _spring(sym, motions, load)
    if load.kind == "bushing":
        return wrenches_of(bushing(sym, motions, load), load)
    body = load.bodies[0]
    if load.kind == "field":
        at = place_of(sym, motions, load)
        value = vector([SX(0) if s is None else at_place(sym, s, at) for s in load.vector])
    else:
        value = vector([SX(0) if s is None else sym.load(s) for s in load.vector])
    if load.body_frame:
        value = motions[body].R @ value
    if load.kind == "torque":
        return [(body, ca.sparsify(ca.vertcat(zeros(3), value)))]
    lever = motions[body].R @ sym.leaves(load.points[0])
    if load.kind == "drag":
        value = drag(value, point_motion(motions[body], lever)[1])
    return [(body, ca.sparsify(ca.vertcat(value, cross(lever, value))))]


def place_of(sym: Symbols, motions: Motions, load: Load) -> SX:
    """World position (3) of the point of a load on a body, m."""
    motion = motions[load.bodies[0]]
    return point_motion(motion, motion.R @ sym.leaves(load.points[0]))[0]


def at_place(sym: Symbols, s: Signal, at: SX) -> SX:
    """Value of a function of the position ``at`` (3), m."""
    return computed(s.formula, lambda i: [sym.leaf(s.leaves[i])], lambda k: [at[k]], operate)[0]


def drag(numbers: SX, v: SX) -> SX:
    """Drag −½ ρ c A |v| v. numbers: density ρ, coefficient c, area A."""
    return -0.5 * numbers[0] * numbers[1] * numbers[2] * ca.sqrt(ca.dot(v, v) + TINY) * v


@dataclass
class SpringLine:
    """Line of a spring-damper between two points.

    length, rate   distance of the points, m, and its rate.
    unit           unit vector from the first to the second point, world.
    levers         vector from each body's origin to its point (3 each), world, m."""

    length: SX
    rate: SX
    unit: SX
    levers: list[SX]


def spring_line(ends: Sequence[Motion], points: Sequence[SX]) -> SpringLine:
    """The line between two points, one on each of two bodies. ends: motions of the bodies. points: in body axes, m."""
    levers = [m.R @ p for m, p in zip(ends, points, strict=True)]
    (xa, va), (xb, vb) = (point_motion(m, lever) for m, lever in zip(ends, levers, strict=True))
    line = ca.sparsify(xb - xa)
    length = ca.sqrt(ca.dot(line, line) + TINY)
    unit = line / length
    return SpringLine(length, ca.dot(ca.sparsify(vb - va), unit), unit, levers)


def line_of(sym: Symbols, motions: Motions, load: Load) -> SpringLine:
    """The line of a spring-damper of the scene."""
    return spring_line(motions_of(motions, load.bodies), [sym.leaves(p) for p in load.points])


def _spring(sym: Symbols, motions: Motions, load: Load) -> list[tuple[int, SX]]:
    """Wrenches of a spring-damper. The force on the second body along ``unit`` is −(K (L − l0) + C L̇ + nonlinear forces); the
    first body gets the opposite force."""
    k, c, free = (sym.leaf(x) for x in load.numbers)
    line = line_of(sym, motions, load)
    force = line.unit * (k * (line.length - free) + c * line.rate + nonlinear_force(sym, load.nonlinear, line.length, line.rate))
    return [
        (body, ca.sparsify(ca.vertcat(sign * force, sign * cross(lever, force))))
        for body, lever, sign in zip(load.bodies, line.levers, (1, -1), strict=True)
        if body != GROUND
    ]


def nonlinear_force(sym: Symbols, laws: Sequence[LawForce], x: SX, rate: SX) -> SX:
    """Force of nonlinear springs and dampers, positive against the coordinate x (``scene.force_laws``)."""
    return sum((FORCE_LAWS[n.law].force([sym.leaf(leaf) for leaf in n.leaves], x, rate) for n in laws), SX(0))


def nonlinear_position(sym: Symbols, law: LawForce, x: SX, rate: SX) -> SX:
    """Position in the curve of a nonlinear spring or damper, in pieces (``ForceLaw.passed``)."""
    return FORCE_LAWS[law.law].passed([sym.leaf(leaf) for leaf in law.leaves], x, rate)


def nonlinear_energy(sym: Symbols, laws: Sequence[LawForce], x: SX) -> SX:
    """Energy that nonlinear springs store."""
    elastic = [n for n in laws if FORCE_LAWS[n.law].elastic]
    return sum((FORCE_LAWS[n.law].stored([sym.leaf(leaf) for leaf in n.leaves], x) for n in elastic), SX(0))


def nonlinear_power(sym: Symbols, laws: Sequence[LawForce], x: SX, rate: SX) -> SX:
    """Power of nonlinear dampers, W (≤ 0)."""
    return -nonlinear_force(sym, [n for n in laws if not FORCE_LAWS[n.law].elastic], x, rate) * rate


def device_force(sym: Symbols, d: Device, q: SX | None, rate: SX) -> SX:
    """Sum of the forces of spring, damper, end stops, latch, effort and motor along a freedom, on the outboard part. The effort of
    a drive is not included, because this effort is a reaction."""
    out = SX(0)
    if d.spring is not None and q is not None:
        out = out - sym.leaf(d.spring[0]) * (q - sym.leaf(d.spring[1]))
    if d.damping is not None:
        out = out - sym.leaf(d.damping) * rate
    if d.nonlinear is not None:
        out = out - nonlinear_force(sym, d.nonlinear, SX(0) if q is None else q, rate)
    if d.effort is not None:
        out = out + sym.load(d.effort)
    if d.motor is not None:
        out = out + motor_force(sym, d.motor, sym.load(d.motor.signal), rate)
    if d.stop is not None and q is not None:
        out = out + stop_force(sym, d, q, rate)
    if d.latch is not None and q is not None:
        out = out + latch_forces.force(sym, d.latch, sym.latch_flags(d.latch), q, rate)
    return out


def motor_force(sym: Symbols, m: Motor, signal: SX, rate: SX) -> SX:
    """Effort of a motor: stall · (signal − rate/no_load). The signal shifts the effort–rate line parallel to itself."""
    return sym.leaf(m.stall) * (signal - rate / sym.leaf(m.no_load))


def stop_force(sym: Symbols, d: Device, q: SX, rate: SX) -> SX:
    """Force of a freedom's end stops by Hunt and Crossley: stiffness · depth · (1 + damping · rate of depth), or 0 where this force
    would pull. Events set and clear the stop's flag."""
    out = SX(0)
    assert d.stop is not None
    for bound, flag, sign in zip((d.stop.lower, d.stop.upper), d.stop.flags, (1, -1), strict=True):
        if bound is None:
            continue
        depth = sign * (sym.leaf(bound) - q)
        push = sym.leaf(d.stop.stiffness) * depth * ca.fmax(stop_push(sym.leaf(d.stop.damping), sign, rate), 0)
        out = out + sign * sym.stop_flag(flag) * push
    return out


def stop_push(damping: SX, sign: int, rate: SX) -> SX:
    """Factor of an end stop's elastic force. Where the factor is 0, the part leaves faster than the stop expands, and the stop
    releases the part. A time step ends where the factor becomes 0."""
    return 1 - damping * sign * rate


def joint_forces(sym: Symbols, step: Step) -> list[SX]:
    """The ``device_force`` along every freedom of a tree joint."""
    j = step.joint
    out = []
    for k, d in enumerate(j.devices):
        i = j.kind.coordinate_of(k)
        out.append(device_force(sym, d, step.coordinates[i] if i >= 0 else None, step.rates[k]))
    return out


def rotors(sym: Symbols, j: Joint) -> SX:
    """Rotor inertias of a tree joint's free freedoms as a diagonal matrix (n×n)."""
    own = [j.devices[k].turned for k in j.free]
    return ca.diag(ca.sparsify(ca.vertcat(SX(0, 1), *[SX(0) if i is None else sym.leaf(i) for i in own])))
