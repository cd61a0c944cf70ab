"""Powers that are integrated along with the motion: friction of each joint, dampers, drives, loads. The audit uses these
integrals."""

from __future__ import annotations

import casadi as ca

from trunnion.kernel.interface.runtime_tables import names_of_powers
from trunnion.recursion import cut_joint_constraints as cutting
from trunnion.recursion import latch_forces
from trunnion.recursion.bushing_forces import bushing
from trunnion.recursion.complement_equation_terms import joint_rates
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.joint_reactions import on_outboard
from trunnion.recursion.masses_and_forces import device_force, line_of, motor_force, nonlinear_power, stop_force, wrenches
from trunnion.recursion.outward_accelerations import Accelerations
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import Device, Joint, Load


def powers(m: Model, acc: Accelerations, pick: SX) -> list[tuple[str, SX]]:
    """Pairs (name, power). The names are "friction:JOINT", "damping", "drive" and "load". Powers of friction and damping are ≤ 0,
    except for energy that bristles return."""
    sym = m.sym
    values = [*(friction_power(m, j) for j in sym.system.frictional), _damping(m), _drive(m, acc, pick), _loads(m)]
    return list(zip(names_of_powers(sym.system), values, strict=True))


def friction_power(m: Model, j: Joint) -> SX:
    """Power of a joint's friction, −Σ η·rate over its freedoms, W."""
    assert j.friction is not None
    eta = j.friction.eta
    return -sum((m.sym.eta[e] * r for e, r in zip(eta, joint_rates(m, j), strict=True)), SX(0))


def coordinates_of(m: Model, j: Joint) -> list[SX]:
    """Coordinates of a tree joint or cut joint."""
    if not j.cut:
        return m.steps[j.child].coordinates
    return cutting.coordinates(next(c for c in m.cuts if c.joint.name == j.name))


def _damping(m: Model) -> SX:
    """Power, W (≤ 0), of joint dampers, dampers between points, drag, bushings, and the damping part of end stops and latches."""
    total = SX(0)
    for j in m.sym.system.joints:
        if not j.kind.nv:
            continue
        q, rates = coordinates_of(m, j), joint_rates(m, j)
        for k, d in enumerate(j.devices):
            if d.damping is not None:
                total -= m.sym.leaf(d.damping) * rates[k] ** 2
            i = j.kind.coordinate_of(k)
            if d.nonlinear is not None:
                total += nonlinear_power(m.sym, d.nonlinear, q[i] if i >= 0 else SX(0), rates[k])
            if d.stop is not None and i >= 0:
                total += _stop_damping(m, d, q[i], rates[k])
            if d.latch is not None and i >= 0:
                flags = m.sym.latch_flags(d.latch)
                pressed = latch_forces.force(m.sym, d.latch, flags, q[i], rates[k]) - latch_forces.elastic(
                    m.sym, d.latch, flags, q[i]
                )
                total += pressed * rates[k]
    for load in m.sym.system.loads:
        if load.kind == "spring_damper":
            line = line_of(m.sym, m.motions, load)
            total -= m.sym.leaf(load.numbers[1]) * line.rate**2
            total += nonlinear_power(m.sym, load.nonlinear, line.length, line.rate)
        if load.kind == "bushing":
            total += bushing(m.sym, m.motions, load).taken
        if load.dissipates:
            total += load_power(m, load)
    return total


def load_power(m: Model, load: Load) -> SX:
    """Power of a load on a body, W."""
    each = ((m.motions[body], w) for body, w in wrenches(m.sym, m.motions, load))
    return sum((ca.dot(w[:3], motion.rdot) + ca.dot(w[3:], motion.omega) for motion, w in each), SX(0))


def _stop_damping(m: Model, d: Device, q: SX, rate: SX) -> SX:
    """Power, W, of the damping part of an end stop's force."""
    return (stop_force(m.sym, d, q, rate) - stop_spring(m, d, q)) * rate


def stop_spring(m: Model, d: Device, q: SX) -> SX:
    """Elastic part of an end stop's force."""
    out = SX(0)
    assert d.stop is not None
    for bound, flag in zip((d.stop.lower, d.stop.upper), d.stop.flags, strict=True):
        if bound is not None:
            out += m.sym.stop_flag(flag) * m.sym.leaf(d.stop.stiffness) * (m.sym.leaf(bound) - q)
    return out


def drive_effort(m: Model, acc: Accelerations, pick: SX, j: Joint, k: int) -> SX:
    """Effort of the drive of freedom k on the outboard part. Effort = reaction along the freedom − device forces + η (the friction
    force is −η) + inertia force of the rotor."""
    f, t, _ = on_outboard(m, acc, j, pick)
    step = m.steps[j.child]
    total = SX(0)
    for a in j.kind.axes[k]:
        h = (step.Ein if a.side == "in" else step.Eout)[:, a.index]
        scale = m.sym.leaf(j.pitch) / (2 * ca.pi) if a.by_pitch and j.pitch is not None else SX(1)
        total += ca.dot(t, h) if a.rot else scale * ca.dot(f, h)
    i = j.kind.coordinate_of(k)
    device = device_force(m.sym, j.devices[k], step.coordinates[i] if i >= 0 else None, step.rates[k])
    friction = SX(0)
    if j.friction:
        eta = j.friction.eta
        friction = m.sym.eta[eta[k]]
    rotor = j.devices[k].inertia
    turned = SX(0) if rotor is None else m.sym.leaf(rotor) * m.sym.driven_accelerations(j)[k]
    return total - device + friction + turned


def _drive(m: Model, acc: Accelerations, pick: SX) -> SX:
    total = SX(0)
    for j in m.sym.system.tree:
        for k in j.driven:
            total += drive_effort(m, acc, pick, j, k) * m.steps[j.child].rates[k]
    return total


def _loads(m: Model) -> SX:
    """Power of applied forces and torques, of joint efforts and of motors, W."""
    total = SX(0)
    for load in m.sym.system.loads:
        if not load.joins and not load.dissipates:
            total += load_power(m, load)
    for j in m.sym.system.joints:
        for k, d in enumerate(j.devices):
            if d.effort is not None:
                total += m.sym.load(d.effort) * joint_rates(m, j)[k]
            if d.motor is not None:
                rate = joint_rates(m, j)[k]
                total += motor_force(m.sym, d.motor, m.sym.load(d.motor.signal), rate) * rate
    return total

