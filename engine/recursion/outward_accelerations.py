"""The outward pass (paper §6): accelerations and joint reactions, as affine maps of the multipliers or as values."""

from __future__ import annotations

import casadi as ca

from trunnion.basics.interrupts import heed
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.masses_and_forces import ground_acceleration
from trunnion.recursion.vector_algebra import SX, Gamma, GammaT, solve_spd, zeros
from trunnion.system.structure.bodies_and_joints import GROUND


@dataclass
class Accelerations:
    """Accelerations and reactions as affine maps of [1; λ; η], or as values (a single column).

    qdd    q̈ of each tree joint's free freedoms (n×columns).
    Zdot   Ż − [g; 0] of each body (6×columns): gravity is an acceleration −g of the ground.
    N      reaction on each body by the tree joint that carries it, at the body's origin (6×columns) (103)."""

    qdd: list[SX]
    Zdot: list[SX]
    N: list[SX]


def outward(m: Model, combine: SX | None = None, reactions: bool = True) -> Accelerations:
    """The outward pass (96)–(102). combine = [1; λ; η] (columns×1): values of the multipliers; all results then have a single
    column. reactions: whether to compute N; otherwise N is zero."""
    n = m.columns if combine is None else 1
    pick = SX.eye(n) if combine is None else combine
    first = zeros(1, n)
    first[0, 0] = 1
    base = ca.sparsify(ground_acceleration(m.sym) @ first)
    out = Accelerations([], [], [])
    for i, (b, step) in enumerate(zip(m.bodies, m.steps, strict=True)):
        heed()
        parent = m.sym.system.bodies[i].parent
        Zp = base if parent == GROUND else out.Zdot[parent]
        carried = Gamma(step.lever, Zp)
        qdd = ca.sparsify(b.y @ pick - solve_spd(b.Mq, b.MPi.T @ carried))
        Z = ca.sparsify(carried + step.Pi @ qdd + step.w @ first)
        out.qdd.append(qdd)
        out.Zdot.append(Z)
        out.N.append(ca.sparsify(b.times(Z[:3, :], Z[3:, :]) - b.F @ pick) if reactions else zeros(6, n))
    return out


def balance(m: Model, qdd: SX, combine: SX) -> Accelerations:
    """Ż and N of a model that is not reduced, for known accelerations and multipliers (theory, "Affine maps").

    Ż is computed outward by (14). N is computed inward by the balance of each body: N_i = M_i Ż_i − F_i + Σ Γᵀ N_k over the bodies
    k that body i carries. qdd: accelerations of the free freedoms (nv×1). combine: [1; λ; η]."""
    out = Accelerations([], [], [])
    base = ground_acceleration(m.sym)
    for i, step in enumerate(m.steps):
        heed()
        parent = m.sym.system.bodies[i].parent
        Zp = base if parent == GROUND else out.Zdot[parent]
        mine = qdd[step.joint.v0 : step.joint.v0 + len(step.joint.free)] if step.joint.free else SX(0, 1)
        out.qdd.append(mine)
        out.Zdot.append(ca.sparsify(Gamma(step.lever, Zp) + step.Pi @ mine + step.w))
    N = [ca.sparsify(b.times(Z[:3], Z[3:]) - b.F @ combine) for b, Z in zip(m.bodies, out.Zdot, strict=True)]
    for i in reversed(range(len(N))):
        parent, lever = m.sym.system.bodies[i].parent, m.steps[i].lever
        if parent != GROUND:
            N[parent] = ca.sparsify(N[parent] + GammaT(lever, N[i]))
    out.N = N
    return out
