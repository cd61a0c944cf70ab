"""The inward pass (paper §3, §6). Bodies are removed one by one, from the leaves of the tree to the ground. Each removed body
transfers its inertia and forces to its inboard body.

Because forces have the columns [known | λ | η], one pass gives the affine maps of all results. Derivation: theory, "Reduction"
and "Cut joints"."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from typing import Any

import casadi as ca

from trunnion.basics.interrupts import heed
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.recursion import cut_joint_constraints as cutting
from trunnion.recursion.body_kinematics import Motion, Step, motions_of, walk
from trunnion.recursion.masses_and_forces import (
    Mass,
    applied,
    device_force,
    ground_acceleration,
    joint_forces,
    mass_matrix,
    rotors,
    velocity_force,
)
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, GammaT, skew, solve_spd, symmetric, zeros
from trunnion.system.structure.bodies_and_joints import GROUND, Joint


@dataclass
class Articulated:
    """Body i after all outboard bodies have been removed.

    M11, M12, M22   blocks (3×3) of the mass matrix M̄, with the transferred inertia.
    F               forces F̄ (6×columns).

    ``project`` adds terms of the joint's n free freedoms:
    MPi             M̄ Π (6×n).
    Mq              Πᵀ M̄ Π + rotor inertias (n×n).
    Fq              forces along the freedoms, Πᵀ(F̄ − M̄ w) + Q (n×columns).
    y               Mq⁻¹ Fq, the accelerations of the freedoms if the inboard body has Ż = 0 (n×columns)."""

    M11: SX
    M12: SX
    M22: SX
    F: SX
    MPi: SX = field(default_factory=SX)
    Mq: SX = field(default_factory=SX)
    Fq: SX = field(default_factory=SX)
    y: SX = field(default_factory=SX)

    def solve(self, b: SX) -> SX:
        """Mq⁻¹ b: accelerations of the joint's freedoms under forces b (n×columns)."""
        return solve_spd(self.Mq, b)

    def times(self, top: SX, bottom: SX) -> SX:
        """M̄ times the matrix [top; bottom] (3×columns each)."""
        return ca.sparsify(ca.vertcat(self.M11 @ top + self.M12 @ bottom, self.M12.T @ top + self.M22 @ bottom))


@dataclass
class Model:
    """Symbolic model of a system at one instant. motions, masses, steps, bodies and Q have one entry per body.

    masses        mass of each body itself, without transferred inertia.
    steps         step over the tree joint that carries the body.
    Q             forces along the free freedoms of this joint (n×columns).
    S, Se, g0     constraint equations of all cut joints (90): S λ + Se η + g0 = 0. In the paper's terms,
                  S = G_λ + G_q H^λ (m×m) and Se = G_η + G_q H^η (m×nη).
    made          results of ``once``, by function."""

    sym: Symbols
    motions: list[Motion]
    masses: list[Mass]
    steps: list[Step]
    cuts: list[cutting.Cut]
    bodies: list[Articulated]
    Q: list[SX]
    S: SX
    Se: SX
    g0: SX
    made: dict[Callable, Any] = field(default_factory=dict)

    @property
    def columns(self) -> int:
        """Number of force columns: one for known forces, one per λ, one per η."""
        return 1 + self.sym.system.rows + self.sym.system.neta

    def cut(self, j: Joint) -> cutting.Cut:
        """The frames and rows of a cut joint."""
        return next(c for c in self.cuts if c.joint.name == j.name)

    def once(self, build: Callable[[Model], Any]) -> Any:
        """The result of ``build(self)``, which is called only once. The model and its reduced copy share this result, so the result
        must not depend on the reduction."""
        if build not in self.made:
            self.made[build] = build(self)
        return self.made[build]


def model(sym: Symbols) -> Model:
    """The reduced model of a system: kinematics outward, then reduction inward."""
    return reduce_model(build_model(sym))


def build_model(sym: Symbols) -> Model:
    """The model before reduction. ``outward_accelerations.balance``, which gets known accelerations, uses this model."""
    system = sym.system
    motions: list[Motion] = []
    steps: list[Step] = []
    for body, joint in zip(system.bodies, system.tree, strict=True):
        heed()
        m, step = walk(sym, joint, *motions_of(motions, (body.parent,)))
        motions.append(m)
        steps.append(step)
    cuts = [cutting.cut(sym, motions, j) for j in system.cuts]
    heed()
    masses = [mass_matrix(sym, body, motion.R) for body, motion in zip(system.bodies, motions, strict=True)]
    heed()
    made = Model(sym, motions, masses, steps, cuts, [], [], zeros(0), zeros(0), zeros(0))
    made.bodies = _bodies(made)
    return made


def reduce_model(m: Model) -> Model:
    """A reduced copy of the model."""
    made = replace(m, bodies=[replace(b) for b in m.bodies], Q=[_generalised(m, s) for s in m.steps])
    _reduce(made)
    return made


def _bodies(m: Model) -> list[Articulated]:
    """Every body before reduction: its mass matrix and its force columns [F⁰ + F^a | W^N | W^F]. W^N and W^F are columns of the cut
    joints."""
    sym, n = m.sym, m.columns
    loads = applied(sym, m.motions)
    out = []
    for mass, motion, load in zip(m.masses, m.motions, loads, strict=True):
        heed()
        F = zeros(6, n)
        F[:, 0] = velocity_force(mass, motion.omega) + load
        out.append(Articulated(mass.M11, mass.M12, mass.M22, ca.sparsify(F)))
    for c in m.cuts:
        _cut_columns(m, c, out)
    return out


def _cut_columns(m: Model, c: cutting.Cut, bodies: list[Articulated]) -> None:
    """Add the force columns (71), (72) of a cut joint, and the forces of its devices, to the joint's bodies."""
    j = c.joint
    for k, row in enumerate(c.rows):
        for body, g in zip(j.ends, row.on, strict=True):
            if body != GROUND:
                bodies[body].F[:, 1 + j.rows + k] += g
    coordinates, rates = (cutting.coordinates(c), cutting.rates(c)) if j.kind.nv else ([], [])
    for k, device in enumerate(j.devices):
        on_in, on_out = cutting.axis_wrenches(c, k)
        i = j.kind.coordinate_of(k)
        force = device_force(m.sym, device, coordinates[i] if i >= 0 else None, rates[k])
        for body, g in ((j.inb, on_in), (j.out, on_out)):
            if body == GROUND:
                continue
            bodies[body].F[:, 0] += g * force
            if j.friction:
                bodies[body].F[:, eta_column(m, j, k)] -= g
    for b in bodies:
        b.F = ca.sparsify(b.F)


def eta_column(m: Model, j, freedom: int) -> int:
    """Index of the force column of a freedom's friction multiplier."""
    first = j.friction.eta[0]
    return 1 + m.sym.system.rows + first + freedom


def _generalised(m: Model, step: Step) -> SX:
    """Forces on the outboard part of a tree joint along its n free freedoms (n×columns). Column 0 contains the forces of devices.
    The η column of a freedom has the entry −1 in the freedom's row, because η acts on the inboard part. The column of a light
    freedom's multiplier has the entry 1."""
    j = step.joint
    Q = zeros(len(j.free), m.columns)
    forces = joint_forces(m.sym, step)
    for row, k in enumerate(j.free):
        Q[row, 0] = forces[k]
        if j.friction:
            Q[row, eta_column(m, j, k)] = -1
        for c in m.sym.system.light_rows_of(j):
            if c.light is not None and c.light.freedom == k:
                Q[row, 1 + c.rows] = 1
    return ca.sparsify(Q)


def _reduce(m: Model) -> None:
    """The inward pass (35)–(42), (78), (79): transfer the inertia and forces of each body to its inboard body, and add up the terms
    of the constraint equations (83)–(89)."""
    system = m.sym.system
    nl, ne = system.rows, system.neta
    lam, eta = slice(1, 1 + nl), slice(1 + nl, 1 + nl + ne)
    total = zeros(nl, m.columns)
    ground = zeros(6, m.columns)
    for i in reversed(range(len(system.bodies))):
        heed()
        b, step, parent = m.bodies[i], m.steps[i], system.bodies[i].parent
        project(b, step, m.Q[i], rotors(m.sym, step.joint))
        total += b.Fq[:, lam].T @ b.y
        total[:, 0] += b.F[:, lam].T @ step.w
        moved = ca.sparsify(b.F - b.MPi @ b.y)
        moved[:, 0] -= b.times(step.w[:3], step.w[3:])
        handed = GammaT(step.lever, moved)
        if parent == GROUND:
            ground += handed
        else:
            _absorb(m.bodies[parent], b, step.lever, handed)
    ground_z = ground_acceleration(m.sym)
    for c in m.cuts:
        for k, row in enumerate(c.rows):
            total[c.joint.rows + k, 0] += row.xi
            for body, g in zip(c.joint.ends, row.on, strict=True):
                if body == GROUND:
                    ground[:, 1 + c.joint.rows + k] += g
    total[:, 0] += ground[:, lam].T @ ground_z
    total = ca.sparsify(total)
    m.S, m.Se, m.g0 = symmetric(total[:, lam]), total[:, eta], total[:, 0]
    for j in system.light:
        assert j.light is not None
        m.S[j.rows, j.rows] += j.light.response


def project(b: Articulated, step: Step, Q: SX, turned: SX) -> None:
    """Compute the terms of the joint's freedoms (27)–(30): M̄ Π, M_q, F_q, y. turned: rotor inertias of the free freedoms (n×n), to
    be added to M_q (theory, "Reduction")."""
    Pi = step.Pi
    b.MPi = ca.sparsify(b.times(Pi[:3, :], Pi[3:, :]))
    b.Mq = symmetric(Pi.T @ b.MPi + turned) if Pi.size2() else zeros(0, 0)
    forces = SX(b.F)
    forces[:, 0] -= b.times(step.w[:3], step.w[3:])
    b.Fq = ca.sparsify(Pi.T @ forces + Q)
    b.y = solve_spd(b.Mq, b.Fq)


def transferred_inertia(b: Articulated, lever: SX) -> tuple[SX, SX, SX]:
    """Inertia that the inboard body gains (36), as blocks: ΔM = Γᵀ(M̄ − M̄ Π Mq⁻¹ Πᵀ M̄)Γ with Γ = [E −l̃; 0 E], l: lever."""
    V = b.solve(b.MPi.T)
    top, bottom = b.MPi[:3, :], b.MPi[3:, :]
    M11 = symmetric(b.M11 - top @ V[:, :3])
    M12 = b.M12 - top @ V[:, 3:]
    M22 = symmetric(b.M22 - bottom @ V[:, 3:])
    L = skew(lever)
    moved = ca.sparsify(M12 - M11 @ L)
    return M11, moved, symmetric(M22 - M12.T @ L + L @ moved)


def _absorb(parent: Articulated, b: Articulated, lever: SX, handed: SX) -> None:
    """Remove the body b: add its inertia and its transferred forces ``handed`` to its inboard body (40)–(42)."""
    M11, M12, M22 = transferred_inertia(b, lever)
    parent.M11 = symmetric(parent.M11 + M11)
    parent.M12 = ca.sparsify(parent.M12 + M12)
    parent.M22 = symmetric(parent.M22 + M22)
    parent.F = ca.sparsify(parent.F + handed)
