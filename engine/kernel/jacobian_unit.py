"""The Jacobian unit: exact derivatives of F = [q̇; v̇; friction states] and of the multiplier residuals R = [R_λ; R_η] by
y, t and z = [λ; η]; in the redundant variant also of the scaled reactions, which decide there what the motion leaves open.

The runtime combines them by the implicit-function theorem: dF/dy = F_y − F_z R_z⁻¹ R_y. Small systems get one dense function
(its columns share all intermediate values); large ones a directional derivative in two stages, the point once and then a column
at a time, because dense code grows with the square of the number of bodies and takes minutes to compile.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from engine.basics.interrupts import heed
from engine.kernel.calling import CONST, PREPARE, STATE, active_rows, combination, inputs, qdot
from engine.kernel.emit import Input, Output, Stage, emit
from engine.recursion.accelerations import Accelerations, outward
from engine.recursion.elements import acceleration_rows, bristle_rates, joint_rates, laws, numbers, reaction_rows, wrench
from engine.recursion.reduction import Model
from engine.recursion.redundancy import scaled_reactions
from engine.recursion.springs import rubbing_rows
from engine.recursion.vectors import SX
from engine.system.elements import elements
from engine.system.external import TABLE
from engine.system.loops import rubbing_on_loops

DENSE_STATES = 28
"""Up to this many states a dense function is generated. Measured: 16 bodies in a chain give 91,000 operations dense and 14,000 for
one direction; the cross-over in cost lies near ten bodies."""


@dataclass
class JacobianUnit:
    """C text and sizes of the unit."""

    text: str
    nc: int
    nw: int
    dense: bool


def residuals(m: Model, acc: Accelerations, pick: SX, active: list[int]) -> SX:
    """R_λ = S λ + Se η + g0 over active rows, R_η = η − law(N(y, λ, η), rates(y)); for a pair held at rest the acceleration of its
    freedom instead."""
    sym = m.sym
    out = [(m.S @ sym.lam + m.Se @ sym.eta + m.g0)[active]] if active else []
    eta: list[SX] = [SX(0)] * sym.system.neta
    for e in elements(sym.system):
        w = wrench(e, reaction_rows(m, acc, e, pick))
        values = e.contact.friction(w, joint_rates(m, e.joint), laws(sym, e), numbers(sym, e), e.friction.adams)
        for i, value in zip(e.eta, values, strict=True):
            eta[i] = sym.eta[i] - value
        if e.sets:
            at_rest = acceleration_rows(m, acc, e.joint)
            for s, law in zip(e.friction.sliders, laws(sym, e), strict=True):
                for i in s.eta:
                    eta[i] = ca.if_else(law.stuck, at_rest[i - e.eta[0]], eta[i])
    return ca.vertcat(SX(0, 1), *out, *eta)


def jacobian_unit(m: Model, redundant: bool = False) -> JacobianUnit:
    """Build the Jacobian unit of a model."""
    sym, active = m.sym, list(range(m.sym.system.rows)) if redundant else list(active_rows(m))
    pick = combination(sym)
    acc = outward(m, pick)
    rate = [*qdot(sym, sym.v), *[a[i] for a in acc.qdd for i in range(a.numel())], *bristle_rates(m, acc, pick)]
    kappa = scaled_reactions(m, acc, pick) if redundant else SX(0, 1)
    turned = [rubbing_rows(m, e, reaction_rows(m, acc, e, pick)) for e, _, _ in rubbing_on_loops(sym.system)] if redundant else []
    f = ca.vertcat(SX(0, 1), *rate, residuals(m, acc, pick, active), kappa, *turned)
    inactive = [k for k in range(sym.system.rows) if k not in active]
    if inactive:
        f = ca.substitute(f, ca.vertcat(*[sym.lam[k] for k in inactive]), SX.zeros(len(inactive)))
    y = ca.vertcat(sym.q, sym.v, sym.b)
    lam = ca.vertcat(SX(0, 1), *[sym.lam[k] for k in active])
    z = ca.vertcat(lam, sym.eta)
    ins = [*inputs(sym), Input("z", lam, 1), Input(f"z+{len(active)}", sym.eta, 1)]
    if y.numel() <= DENSE_STATES:
        return _dense(sym, f, y, z, ins)
    return _directional(sym, f, y, z, ins)


def time_direction(sym) -> SX:
    """Rate of x with time: 1 for t, and of each table's numbers the next derivative."""
    d = SX.zeros(sym.x.shape[0])
    d[0] = 1
    for k in range(sym.system.tables):
        at = sym.at.table(k)
        for i in range(TABLE - 1):
            d[at + i] = sym.x[at + i + 1]
    return d


def _dense(sym, f: SX, y: SX, z: SX, ins: list[Input]) -> JacobianUnit:
    full = []
    for made in (lambda: ca.jacobian(f, y), lambda: ca.jtimes(f, sym.x, time_direction(sym)), lambda: ca.jacobian(f, z)):
        heed()
        full.append(made())
    stages = [Stage("j_prepare", PREPARE, "c"),
              Stage("j_eval", f"{STATE},{CONST}z,double*restrict w,double*restrict J", "")]
    code = emit(ins, [Output("J", 0, ca.vec(ca.densify(ca.horzcat(*full))), 1)], stages)
    return JacobianUnit(code.text, code.kept[0], 0, True)


def _directional(sym, f: SX, y: SX, z: SX, ins: list[Input]) -> JacobianUnit:
    n = y.numel() + 1 + z.numel()
    seed = SX.sym("seed", n)
    ny = y.numel()
    arguments = ca.vertcat(sym.x, y, z)
    direction = ca.vertcat(time_direction(sym) * seed[ny], seed[:ny], seed[ny + 1 :])
    column = ca.jtimes(f, arguments, direction)
    stages = [
        Stage("j_prepare", PREPARE, "c"),
        Stage("j_point", f"{STATE},{CONST}z,double*restrict w", "w"),
        Stage("j_along", f"{STATE},{CONST}z,{CONST}w,{CONST}seed,double*restrict J", ""),
    ]
    code = emit([*ins, Input("seed", seed, 2)], [Output("J", 0, column, 2)], stages)
    return JacobianUnit(code.text, code.kept[0], code.kept[1], False)
