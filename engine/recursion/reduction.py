"""The recursion itself (paper §3 and §6): inward, bodies are removed from the leaves to the ground; outward, accelerations follow.

Forces are carried as columns [bias | λ | η]: one pass gives the affine maps. Two things are said shorter than on paper, with the
same result: what acts along a tree joint's own freedoms (its friction η, springs, dampers, efforts) is a generalised force Q on
those freedoms instead of a wrench on both bodies (Πᵀ of the pair is Q, and the parent gets Cᵀ of it all the same); and since
W^N = Gᵀ, the accumulation (84), (85) is Σ (Πᵀ W̄)ᵀ D⁻¹ (Πᵀ W̄).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi as ca

from engine.recursion import cuts as cutting
from engine.recursion.kinematics import GROUND_MOTION, Motion, Step, walk
from engine.recursion.loads import (
    applied,
    device_force,
    ground_acceleration,
    joint_forces,
    mass_matrix,
    velocity_force,
)
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, cross, skew, solve_spd, symmetric, zeros
from engine.system.structure import GROUND


@dataclass
class Articulated:
    """Body i when it has become a tree end: M̄ (A, B, C), F̄ (6×columns), U = M̄ Π, D = Πᵀ M̄ Π and y = D⁻¹(Πᵀ(F̄ − M̄ w) + Q)."""

    A: SX
    B: SX
    C: SX
    F: SX
    U: SX = field(default_factory=SX)
    D: SX = field(default_factory=SX)
    P: SX = field(default_factory=SX)
    y: SX = field(default_factory=SX)

    def solve(self, b: SX) -> SX:
        """D⁻¹ b."""
        return solve_spd(self.D, b)

    def times(self, top: SX, bottom: SX) -> SX:
        """M̄ [top; bottom]."""
        return ca.sparsify(ca.vertcat(self.A @ top + self.B @ bottom, self.B.T @ top + self.C @ bottom))


@dataclass
class Model:
    """Everything symbolic about a system at one instant."""

    sym: Symbols
    motions: list[Motion]
    steps: list[Step]
    cuts: list[cutting.Cut]
    bodies: list[Articulated]
    Q: list[SX]
    S: SX
    """G_λ, G_η and the constant of S λ + Se η + g0 = 0."""
    Se: SX
    g0: SX

    @property
    def columns(self) -> int:
        """1 + λ + η."""
        return 1 + self.sym.system.rows + self.sym.system.neta


def model(sym: Symbols, reduce: bool = True) -> Model:
    """Kinematics outward, then reduction inward (left out where the accelerations are known: see ``given``)."""
    system = sym.system
    motions: list[Motion] = []
    steps: list[Step] = []
    for body, joint in zip(system.bodies, system.tree, strict=True):
        parent = GROUND_MOTION if body.parent == GROUND else motions[body.parent]
        m, step = walk(sym, joint, parent)
        motions.append(m)
        steps.append(step)
    cuts = [cutting.cut(sym, motions, j) for j in system.cuts]
    made = Model(sym, motions, steps, cuts, [], [], zeros(0), zeros(0), zeros(0))
    made.bodies = _bodies(made)
    if reduce:
        made.Q = [_generalised(made, s) for s in steps]
        _reduce(made)
    return made


def _bodies(m: Model) -> list[Articulated]:
    """M, and F = [F⁰ + F^a | W^N | W^F of cut joints] of every body before reduction."""
    sym, system, n = m.sym, m.sym.system, m.columns
    loads = applied(sym, m.motions)
    out = []
    for body, motion, load in zip(system.bodies, m.motions, loads, strict=True):
        mass = mass_matrix(sym, body, motion.R)
        F = zeros(6, n)
        F[:, 0] = velocity_force(mass, motion.omega) + load
        out.append(Articulated(mass.A, mass.B, mass.C, ca.sparsify(F)))
    for c in m.cuts:
        _cut_columns(m, c, out)
    return out


def _cut_columns(m: Model, c: cutting.Cut, bodies: list[Articulated]) -> None:
    """Force columns of a cut joint (71), (72) and its devices."""
    j = c.joint
    for k, row in enumerate(c.rows):
        for body, g in ((j.inb, row.g_in), (j.out, row.g_out)):
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
    """Column of the friction multiplier of a freedom."""
    first = min(e for s in j.friction.sliders for e in s.eta)
    return 1 + m.sym.system.rows + first + freedom


def _generalised(m: Model, step: Step) -> SX:
    """Q of the free freedoms of a tree joint (n×columns): devices, and −1 in the columns of its friction (η acts on inboard)."""
    j = step.joint
    Q = zeros(len(j.free), m.columns)
    forces = joint_forces(m.sym, step)
    for row, k in enumerate(j.free):
        Q[row, 0] = forces[k]
        if j.friction:
            Q[row, eta_column(m, j, k)] = -1
    return ca.sparsify(Q)


def _reduce(m: Model) -> None:
    """Inward pass (35)–(42), (78), (79), with the constraint equations carried along (83)–(89)."""
    system = m.sym.system
    nl, ne = system.rows, system.neta
    lam, eta = slice(1, 1 + nl), slice(1 + nl, 1 + nl + ne)
    total = zeros(nl, m.columns)
    ground = zeros(6, m.columns)
    for i in reversed(range(len(system.bodies))):
        b, step, parent = m.bodies[i], m.steps[i], system.bodies[i].parent
        U, P = project(b, step, m.Q[i])
        total += P[:, lam].T @ b.y
        total[:, 0] += b.F[:, lam].T @ step.w
        moved = ca.sparsify(b.F - U @ b.y)
        moved[:, 0] -= b.times(step.w[:3], step.w[3:])
        handed = ca.sparsify(ca.vertcat(moved[:3, :], moved[3:, :] + cross(step.lever, moved[:3, :])))
        if parent == GROUND:
            ground += handed
        else:
            _absorb(m.bodies[parent], b, step.lever, handed)
    ground_z = ground_acceleration(m.sym)
    for c in m.cuts:
        for k, row in enumerate(c.rows):
            total[c.joint.rows + k, 0] += row.xi
            for body, g in ((c.joint.inb, row.g_in), (c.joint.out, row.g_out)):
                if body == GROUND:
                    ground[:, 1 + c.joint.rows + k] += g
    total[:, 0] += ground[:, lam].T @ ground_z
    total = ca.sparsify(total)
    m.S, m.Se, m.g0 = symmetric(total[:, lam]), total[:, eta], total[:, 0]


def project(b: Articulated, step: Step, Q: SX) -> tuple[SX, SX]:
    """U, D, P = Πᵀ(F̄ − M̄ w) + Q and y = D⁻¹ P (27)–(30)."""
    Pi = step.Pi
    b.U = ca.sparsify(b.times(Pi[:3, :], Pi[3:, :]))
    b.D = symmetric(Pi.T @ b.U) if Pi.size2() else zeros(0, 0)
    forces = SX(b.F)
    forces[:, 0] -= b.times(step.w[:3], step.w[3:])
    b.P = ca.sparsify(Pi.T @ forces + Q)
    b.y = solve_spd(b.D, b.P)
    return b.U, b.P


def absorbed(b: Articulated, lever: SX) -> tuple[SX, SX, SX]:
    """ΔM (36): M̄ − U D⁻¹ Uᵀ moved by Γ = [E −l̃; 0 E], as blocks A, B, C."""
    V = b.solve(b.U.T)
    top, bottom = b.U[:3, :], b.U[3:, :]
    A = symmetric(b.A - top @ V[:, :3])
    B = b.B - top @ V[:, 3:]
    C = symmetric(b.C - bottom @ V[:, 3:])
    L = skew(lever)
    moved = ca.sparsify(B - A @ L)
    return A, moved, symmetric(C - B.T @ L + L @ moved)


def _absorb(parent: Articulated, b: Articulated, lever: SX, handed: SX) -> None:
    """(40)–(42)."""
    A, B, C = absorbed(b, lever)
    parent.A = symmetric(parent.A + A)
    parent.B = ca.sparsify(parent.B + B)
    parent.C = symmetric(parent.C + C)
    parent.F = ca.sparsify(parent.F + handed)


@dataclass
class Accelerations:
    """Columns of q̈ (per tree joint, n×columns), Ż − [g; 0] and N (103) (6×columns each) per body."""

    qdd: list[SX]
    Z: list[SX]
    N: list[SX]


def outward(m: Model, combine: SX | None = None, reactions: bool = True) -> Accelerations:
    """(96)–(102). ``combine`` (columns×1: [1; λ; η]) turns the maps into numbers before the pass."""
    n = m.columns if combine is None else 1
    pick = SX.eye(n) if combine is None else combine
    first = zeros(1, n)
    first[0, 0] = 1
    base = ca.sparsify(ground_acceleration(m.sym) @ first)
    out = Accelerations([], [], [])
    for i, (b, step) in enumerate(zip(m.bodies, m.steps, strict=True)):
        parent = m.sym.system.bodies[i].parent
        Zp = base if parent == GROUND else out.Z[parent]
        top = ca.sparsify(Zp[:3, :] - cross(step.lever, Zp[3:, :]))
        carried = ca.sparsify(ca.vertcat(top, Zp[3:, :]))
        qdd = ca.sparsify(b.y @ pick - solve_spd(b.D, b.U.T @ carried))
        Z = ca.sparsify(carried + step.Pi @ qdd + step.w @ first)
        out.qdd.append(qdd)
        out.Z.append(Z)
        out.N.append(ca.sparsify(b.times(Z[:3, :], Z[3:, :]) - b.F @ pick) if reactions else zeros(6, n))
    return out


def given(m: Model, qdd: SX, combine: SX) -> Accelerations:
    """Ż and N of an unreduced model from known accelerations of the free rates (nv×1) and multipliers: outward by (14), and inward
    by the balance of every body, N_i = M_i Ż_i − F_i + Σ Γᵀ N of the bodies it carries. The same N as (103), without articulated
    masses."""
    out = Accelerations([], [], [])
    base = ground_acceleration(m.sym)
    for i, step in enumerate(m.steps):
        parent = m.sym.system.bodies[i].parent
        Zp = base if parent == GROUND else out.Z[parent]
        mine = qdd[step.joint.v0 : step.joint.v0 + len(step.joint.free)] if step.joint.free else SX(0, 1)
        carried = ca.sparsify(ca.vertcat(Zp[:3] - cross(step.lever, Zp[3:]), Zp[3:]))
        out.qdd.append(mine)
        out.Z.append(ca.sparsify(carried + step.Pi @ mine + step.w))
    N = [ca.sparsify(b.times(Z[:3], Z[3:]) - b.F @ combine) for b, Z in zip(m.bodies, out.Z, strict=True)]
    for i in reversed(range(len(N))):
        parent, lever = m.sym.system.bodies[i].parent, m.steps[i].lever
        if parent != GROUND:
            N[parent] = ca.sparsify(N[parent] + ca.vertcat(N[i][:3], N[i][3:] + cross(lever, N[i][:3])))
    out.N = N
    return out
