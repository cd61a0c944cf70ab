"""Kinetic and potential energy of a scene."""

from __future__ import annotations

import casadi as ca

from trunnion.kernel.units.power_expressions import coordinates_of
from trunnion.recursion import latch_forces
from trunnion.recursion.bushing_forces import bushing
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.masses_and_forces import line_of, nonlinear_energy
from trunnion.recursion.vector_algebra import SX


def kinetic(m: Model) -> SX:
    """Kinetic energy of the bodies, Σ ½ Zᵀ M Z, and of the rotors, J."""
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
    """Potential energy, J, of gravity (zero at the world's origin), joint springs, engaged end stops, springs between points, and
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
            if d.nonlinear is not None and i >= 0:
                total += nonlinear_energy(sym, d.nonlinear, q[i])
            if d.latch is not None and i >= 0:
                total += latch_forces.potential(sym, d.latch, sym.latch_flags(d.latch), q[i])
            if d.stop is not None and i >= 0:
                for bound, flag in zip((d.stop.lower, d.stop.upper), d.stop.flags, strict=True):
                    if bound is not None:
                        total += 0.5 * sym.leaf(d.stop.stiffness) * sym.stop_flag(flag) * (sym.leaf(bound) - q[i]) ** 2
    for load in sym.system.loads:
        if load.kind == "spring_damper":
            length = line_of(sym, m.motions, load).length
            total += 0.5 * sym.leaf(load.numbers[0]) * (length - sym.leaf(load.numbers[2])) ** 2
            total += nonlinear_energy(sym, load.nonlinear, length)
        if load.kind == "bushing":
            total += bushing(sym, m.motions, load).potential
    return total
