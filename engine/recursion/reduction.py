"""The inward pass (paper §3 and §6): bodies are removed from the leaves to the ground, and hand on their inertia and forces.

Forces are carried as columns [known | λ | η], so that one pass gives the affine maps. Derivation: METHOD, "Reduction", and
METHOD, "Cut joints".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca

from engine.basics.interrupts import heed
from engine.recursion import cuts as cutting
from engine.recursion.kinematics import GROUND_MOTION, Motion, Step, walk
from engine.recursion.loads import (
    Mass,
    applied,
    device_force,
    ground_acceleration,
    joint_forces,
    mass_matrix,
    rotors,
    velocity_force,
)
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, GammaT, skew, solve_spd, symmetric, zeros
from engine.system.structure import GROUND


@dataclass
class Articulated:
    """Body i once it has become a leaf, because the bodies it carries have been removed.

    M11, M12, M22: blocks (3×3) of its mass matrix M̄, which holds theirs; F: its forces F̄ (6×columns). ``project`` adds what belongs
    to the n free freedoms of its joint: MPi = M̄ Π (6×n), Mq = Πᵀ M̄ Π + rotor inertias (n×n), the force along them
    Fq = Πᵀ(F̄ − M̄ w) + Q (n×columns), and y = Mq⁻¹ Fq, their accelerations while the inboard body does not accelerate.
    """

    M11: SX
    M12: SX
    M22: SX
    F: SX
    MPi: SX = field(default_factory=SX)
    Mq: SX = field(default_factory=SX)
    Fq: SX = field(default_factory=SX)
    y: SX = field(default_factory=SX)

    def solve(self, b: SX) -> SX:
        """Mq⁻¹ b: accelerations of the joint's freedoms under forces b (n×columns) along them."""
        return solve_spd(self.Mq, b)

    def times(self, top: SX, bottom: SX) -> SX:
        """M̄ times the motions [top; bottom] (3×columns each)."""
        return ca.sparsify(ca.vertcat(self.M11 @ top + self.M12 @ bottom, self.M12.T @ top + self.M22 @ bottom))


@dataclass
class Model:
    """Everything symbolic about a system at one instant; one entry per body in motions, steps, bodies and Q.

    masses: each body's own. steps: what each tree joint adds. Q: forces along the free freedoms of each tree joint (n×columns).
    S λ + Se η + g0 = 0 are the constraint equations of all cut joints (90): S (m×m) is the paper's G_λ + G_q H^λ, Se (m×nη) its
    G_η + G_q H^η.
    """

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
        """Number of force columns: one for what is known, one for each λ, one for each η."""
        return 1 + self.sym.system.rows + self.sym.system.neta

    def once(self, build: Callable[[Model], Any]) -> Any:
        """``build(self)``, made once for the model and its reduction: of what the reduction does not change."""
        if build not in self.made:
            self.made[build] = build(self)
        return self.made[build]


def model(sym: Symbols) -> Model:
    """Kinematics outward, then reduction inward."""
    return reduced(unreduced(sym))


def unreduced(sym: Symbols) -> Model:
    """The model before its reduction, which is enough where accelerations are known (``accelerations.given``)."""
    system = sym.system
    motions: list[Motion] = []
    steps: list[Step] = []
    for body, joint in zip(system.bodies, system.tree, strict=True):
        heed()
        parent = GROUND_MOTION if body.parent == GROUND else motions[body.parent]
        m, step = walk(sym, joint, parent)
        motions.append(m)
        steps.append(step)
    cuts = [cutting.cut(sym, motions, j) for j in system.cuts]
    heed()
    masses = [mass_matrix(sym, body, motion.R) for body, motion in zip(system.bodies, motions, strict=True)]
    heed()
    made = Model(sym, motions, masses, steps, cuts, [], [], zeros(0), zeros(0), zeros(0))
    made.bodies = _bodies(made)
    return made


def reduced(m: Model) -> Model:
    """The model reduced inward; the one given stays as it is."""
    made = replace(m, bodies=[replace(b) for b in m.bodies], Q=[_generalised(m, s) for s in m.steps])
    _reduce(made)
    return made


def _bodies(m: Model) -> list[Articulated]:
    """Every body before reduction: its mass matrix and its forces [F⁰ + F^a | W^N | W^F of cut joints]."""
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
    """Add a cut joint's force columns (71), (72) to the two bodies it joins, and the forces of its springs, dampers and stops."""
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
    """The force column that belongs to the friction multiplier of one freedom of a joint."""
    first = j.friction.eta[0]
    return 1 + m.sym.system.rows + first + freedom


def _generalised(m: Model, step: Step) -> SX:
    """Forces along the free freedoms of a tree joint (n×columns) on its outboard part: its devices, and −1 in the columns of its
    friction, since η is what friction does to the inboard part."""
    j = step.joint
    Q = zeros(len(j.free), m.columns)
    forces = joint_forces(m.sym, step)
    for row, k in enumerate(j.free):
        Q[row, 0] = forces[k]
        if j.friction:
            Q[row, eta_column(m, j, k)] = -1
    return ca.sparsify(Q)


def _reduce(m: Model) -> None:
    """The inward pass (35)–(42), (78), (79): hand each body's inertia and forces to its inboard body, and accumulate the constraint
    equations (83)–(89) on the way."""
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


def project(b: Articulated, step: Step, Q: SX, turned: SX) -> None:
    """Fill in what belongs to the joint's own freedoms (27)–(30): M̄ Π, M_q, F_q and y. turned: rotor inertias of its free freedoms
    (n×n), which M_q has besides (METHOD, "Reduction")."""
    Pi = step.Pi
    b.MPi = ca.sparsify(b.times(Pi[:3, :], Pi[3:, :]))
    b.Mq = symmetric(Pi.T @ b.MPi + turned) if Pi.size2() else zeros(0, 0)
    forces = SX(b.F)
    forces[:, 0] -= b.times(step.w[:3], step.w[3:])
    b.Fq = ca.sparsify(Pi.T @ forces + Q)
    b.y = solve_spd(b.Mq, b.Fq)


def absorbed(b: Articulated, lever: SX) -> tuple[SX, SX, SX]:
    """ΔM (36) = Γᵀ(M̄ − M̄ Π Mq⁻¹ Πᵀ M̄)Γ with Γ = [E −l̃; 0 E]: what the inboard body gains in inertia, as its blocks."""
    V = b.solve(b.MPi.T)
    top, bottom = b.MPi[:3, :], b.MPi[3:, :]
    M11 = symmetric(b.M11 - top @ V[:, :3])
    M12 = b.M12 - top @ V[:, 3:]
    M22 = symmetric(b.M22 - bottom @ V[:, 3:])
    L = skew(lever)
    moved = ca.sparsify(M12 - M11 @ L)
    return M11, moved, symmetric(M22 - M12.T @ L + L @ moved)


def _absorb(parent: Articulated, b: Articulated, lever: SX, handed: SX) -> None:
    """Add what a removed body hands over to the mass matrix and the forces of its inboard body (40)–(42)."""
    M11, M12, M22 = absorbed(b, lever)
    parent.M11 = symmetric(parent.M11 + M11)
    parent.M12 = ca.sparsify(parent.M12 + M12)
    parent.M22 = symmetric(parent.M22 + M22)
    parent.F = ca.sparsify(parent.F + handed)
