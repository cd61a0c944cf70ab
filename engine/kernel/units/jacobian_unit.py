"""The Jacobian unit: exact derivatives of F = [q̇; v̇; friction states] and of the multiplier residuals R = [R_λ; R_η] by y, t and
z = [λ; η]. The variant for redundant loops also differentiates the scaled reactions. The scaled reactions determine the reactions
that the motion leaves open. The runtime combines these derivatives by the implicit function theorem: dF/dy = F_y − F_z R_z⁻¹ R_y.
Small systems get one dense function, whose columns use common intermediate values. Dense code grows with the square of the number
of bodies and takes minutes to compile. Large systems therefore get a directional derivative in two stages. The first stage computes
values at a point, the second stage computes single columns. """

from __future__ import annotations

import casadi as ca

from trunnion.basics.interrupts import heed
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.c_code.code_generator import Input, Output, Stage, emit
from trunnion.kernel.units.generated_function_inputs import CONST, PREPARE, STATE, Multipliers, combination, inputs, state_rates
from trunnion.recursion.complement_equation_terms import acceleration_rows, joint_rates, laws, numbers, reaction_rows, wrench
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.loop_contact_springs import friction_change_rows
from trunnion.recursion.outward_accelerations import Accelerations, outward
from trunnion.recursion.redundant_loop_reactions import scaled_reactions
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.external_value_layout import TABLE
from trunnion.system.structure.friction_joint_indices import elements
from trunnion.system.structure.loop_joints import rubbing_on_loops

DENSE_STATES = 28
"""Largest number of states for a dense function. For a chain of 16 bodies, the dense function has 91,000 operations. The function
of one direction has 14,000 operations. At about ten bodies, both variants cost the same."""


@dataclass
class JacobianUnit:
    """C text and sizes of the unit."""

    text: str
    nc: int
    nw: int
    dense: bool


def residuals(m: Model, acc: Accelerations, pick: SX, active: list[int]) -> SX:
    """R_λ = S λ + Se η + g0 over the active rows, and R_η = η − law(N(y, λ, η), rates(y)). For pairs at rest, R_η is the
    acceleration of the freedom."""
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
    sym, multipliers = m.sym, Multipliers(m, redundant)
    pick = combination(sym)
    acc = outward(m, pick)
    kappa = scaled_reactions(m, acc, pick) if redundant else SX(0, 1)
    rubbing = rubbing_on_loops(sym.system) if redundant else []
    turned = [friction_change_rows(m, e, reaction_rows(m, acc, e, pick)) for e, _, _ in rubbing]
    f = ca.vertcat(SX(0, 1), *state_rates(m, acc, pick), residuals(m, acc, pick, multipliers.active), kappa, *turned)
    (f,) = multipliers.without_inactive([f])
    y, z = ca.vertcat(sym.q, sym.v, sym.b), ca.vertcat(multipliers.lam, sym.eta)
    make = _dense if y.numel() <= DENSE_STATES else _directional
    return make(sym, f, y, z, [*inputs(sym), *multipliers.inputs(1)])


def time_direction(sym) -> SX:
    """Rate of x with time. The rate of t is 1. The rate of each number of a table is the next number, its derivative."""
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
    seed, ny = SX.sym("seed", n), y.numel()
    direction = ca.vertcat(time_direction(sym) * seed[ny], seed[:ny], seed[ny + 1 :])
    column = ca.jtimes(f, ca.vertcat(sym.x, y, z), direction)
    stages = [
        Stage("j_prepare", PREPARE, "c"),
        Stage("j_point", f"{STATE},{CONST}z,double*restrict w", "w"),
        Stage("j_along", f"{STATE},{CONST}z,{CONST}w,{CONST}seed,double*restrict J", ""),
    ]
    code = emit([*ins, Input("seed", seed, 2)], [Output("J", 0, column, 2)], stages)
    return JacobianUnit(code.text, code.kept[0], code.kept[1], False)
