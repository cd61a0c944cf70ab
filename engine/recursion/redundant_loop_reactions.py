"""Scaled reactions of joints in loops. Redundant loops have many possible reactions; the model uses those whose scaled reactions
have the least sum of squares (theory, "Redundant loops"). Reactions are scaled by the inertia of the parts; in loops with friction,
by the compliance of the contacts."""

from __future__ import annotations

import casadi as ca

from trunnion.recursion.complement_equation_terms import reaction_rows
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.joint_reactions import on_outboard, pose_of
from trunnion.recursion.loop_contact_springs import contact_arm, friction_change_rows, spin, spring_rows
from trunnion.recursion.outward_accelerations import Accelerations
from trunnion.recursion.vector_algebra import SX, cross
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.loop_joints import block_points, loop_joints, rows_of, rubbing_on_loops, rubs


def scaled_reactions(m: Model, acc: Accelerations, pick: SX | None = None) -> SX:
    """Scaled reactions as affine maps (rows×columns). With ``pick`` = [1; λ; η], the results are values (rows×1)."""
    system = m.sym.system
    if not rubs(system):
        return _by_inertia(m, acc, pick)
    points, rows = block_points(system), []
    for j in loop_joints(system):
        pose, arm = pose_of(m, j), contact_arm(m, j, points[j.name])
        rows.append(spring_rows(m.sym, j, *on_outboard(m, acc, j, pick), pose.Ein, pose.Eout, arm))
    return ca.sparsify(ca.vertcat(*rows))


def _by_inertia(m: Model, acc: Accelerations, pick: SX | None) -> SX:
    """Scaled reactions of every joint in a loop, on each of its two parts: force/√m, and torque about the mass centre/√j. m: mass
    of the part. j: half the trace of the part's inertia. Arguments and result are those of ``scaled_reactions``."""
    blocks = [SX(0, m.columns if pick is None else 1)]
    for j in loop_joints(m.sym.system):
        f, t, _ = on_outboard(m, acc, j, pick)
        for body, sign in ((j.out, 1), (j.inb, -1)):
            if body == GROUND:
                continue
            b, motion = m.sym.system.bodies[body], m.motions[body]
            arm = ca.sparsify(_outboard_point(m, j) - (motion.r + motion.R @ m.sym.leaves(b.center)))
            torque = t + cross(arm, f)
            blocks += [sign * f / ca.sqrt(m.sym.leaf(b.mass)), sign * torque / ca.sqrt(spin(m, b))]
    return ca.sparsify(ca.vertcat(*blocks))


def inactive_rows_couple(m: Model, acc: Accelerations, inactive: list[int]) -> bool:
    """Whether the norm of the scaled reactions couples the inactive multipliers to the other multipliers. The motion does not
    determine inactive multipliers. Without coupling (example: a planar mechanism of symmetric bodies), the inactive multipliers are
    zero."""
    if not inactive:
        return False
    maps = scaled_reactions(m, acc)
    free = maps[:, [1 + k for k in inactive]]
    if rubs(m.sym.system):
        maps += _friction_turns(m, acc)
    others = [c for c in range(m.columns) if c - 1 not in inactive]
    return bool(ca.sparsify(free.T @ maps[:, others]).nnz())


def _friction_turns(m: Model, acc: Accelerations) -> SX:
    """The change of the scaled reactions that sliding friction causes, as affine maps (rows×columns). The change is linearised in
    the reactions. The formula of friction at rest is omitted: it couples the same reactions, but its sparsity pattern lacks these
    couplings."""
    system = m.sym.system
    out = SX(sum(n for _, n in rows_of(system)), m.columns)
    for e, at, count in rubbing_on_loops(system):
        values = SX.sym("N", len(e.needs))
        out[at : at + count, :] = ca.jacobian(friction_change_rows(m, e, values, True), values) @ reaction_rows(m, acc, e)
    return ca.sparsify(out)


def _outboard_point(m: Model, j: Joint) -> SX:
    """Position of a joint's point on its outboard part, world (3)."""
    if j.cut:
        c = m.cut(j)
        return c.out.r + c.c_out
    step, motion = m.steps[j.child], m.motions[j.child]
    return motion.r if j.forward else motion.r + step.s
