"""Joint reactions (57)–(66), (71), (103): the wrench that a joint transmits, at a chosen point and in a chosen frame (theory,
"Reactions")."""

from __future__ import annotations

import casadi as ca

from trunnion.basics.interrupts import heed
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact.contact_element import COMPONENTS, OVERLAP, TINY
from trunnion.elements.contact.journal import LENGTHS
from trunnion.recursion import cut_joint_constraints as cutting
from trunnion.recursion.body_kinematics import Pose, Step
from trunnion.recursion.inward_reduction import Model, eta_column
from trunnion.recursion.masses_and_forces import device_force
from trunnion.recursion.outward_accelerations import Accelerations
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross, zeros
from trunnion.system.structure.bodies_and_joints import Joint


def on_outboard(m: Model, acc: Accelerations, j: Joint, combine: SX | None = None) -> tuple[SX, SX, SX]:
    """Total wrench on the outboard part at p_out, given as force and torque in the world (3×columns each), and s = p_out − p_in
    (3)."""
    heed()
    if j.cut:
        c = m.cut(j)
        W = ca.sparsify(_cut_wrench(m, c) if combine is None else _cut_wrench(m, c) @ combine)
        return W[:3, :], W[3:, :], c.s
    s = m.steps[j.child].s
    return *_of_child(j, acc.N[j.child], s), s


def _of_child(j: Joint, N: SX, s: SX) -> tuple[SX, SX]:
    """Force and torque of a tree joint on its outboard part at p_out, from the reaction on its child at the child's origin."""
    f, t = N[:3, :], N[3:, :]
    return (f, t) if j.forward else (-f, -(t - cross(s, f)))


def _cut_wrench(m: Model, c: cutting.Cut) -> SX:
    """Wrench of a cut joint on its outboard part at p_out (6×columns), by (59)–(62). Column 0 contains the forces of devices. Each
    λ column is the wrench of a unit multiplier. Each η column is the negative wrench of a unit multiplier, because η acts on the
    inboard part."""
    j = c.joint
    W = zeros(6, m.columns)
    for k, row in enumerate(c.rows):
        W[:, 1 + j.rows + k] += at_point(row.g_out, c.c_out)
    if j.kind.nv:
        q, rates = cutting.coordinates(c), cutting.rates(c)
        for k, device in enumerate(j.devices):
            unit = at_point(cutting.axis_wrenches(c, k)[1], c.c_out)
            i = j.kind.coordinate_of(k)
            W[:, 0] += unit * device_force(m.sym, device, q[i] if i >= 0 else None, rates[k])
            if j.friction:
                W[:, eta_column(m, j, k)] -= unit
    return ca.sparsify(W)


def at_point(wrench: SX, lever: SX) -> SX:
    """A wrench at a body's origin, moved to a point. lever: vector from the origin to the point."""
    return ca.sparsify(ca.vertcat(wrench[:3, :], wrench[3:, :] - cross(lever, wrench[:3, :])))


def pose_of(m: Model, j: Joint) -> Pose:
    """Pose of a tree or cut joint."""
    holder = m.cut(j) if j.cut else m.steps[j.child]
    return Pose(holder.Ein, holder.Eout, holder.s)


def span(m: Model, j: Joint, columns: int) -> SX:
    """Half the length over which the parts of a joint overlap, m, as a row of the affine maps. All columns but column 0 are zero,
    because the length does not depend on the multipliers."""
    both, pose = lengths(m.sym, j), pose_of(m, j)
    assert both is not None
    return ca.horzcat(overlap(pose.s, pose.Ein, both)[1], SX(1, columns - 1))


def pin_axes(j: Joint, Ein: SX, Eout: SX) -> SX:
    """Axes in which f_c and m_c of a joint with friction are resolved (``ContactElement.frame``), 3×3."""
    frame = CONTACTS[j.kind.friction].frame
    if frame == "both":
        u1, u2 = Ein[:, 0], Eout[:, 1]
        return ca.sparsify(ca.horzcat(u1, u2, cross(u1, u2)))
    return Eout if j.fit.pin_out and frame == "pin" else Ein


def on_pin(m: Model, acc: Accelerations, j: Joint, combine: SX | None = None) -> tuple[SX, SX]:
    """f_c, m_c (3×columns each): total wrench on the part with the pin, about the point of the part with the ends, resolved in
    ``pin_axes``. For a universal joint, f_c and m_c are the wrench on the inboard part; the contact element assigns the journals to
    the parts."""
    f, t, s = on_outboard(m, acc, j, combine)
    pose = pose_of(m, j)
    return on_pin_part(j, f, t, s, pose.Ein, pose.Eout, lengths(m.sym, j))


def lengths(sym: Symbols, j: Joint) -> SX | None:
    """Lengths of the inboard and the outboard part (2), m, if the joint has friction and its parts touch where they overlap;
    otherwise None."""
    if j.fit.ends != OVERLAP or not j.friction:
        return None
    return ca.vertcat(*[sym.leaf(j.friction.number(s.name)) for s in LENGTHS])


def overlap(s: SX, Ein: SX, both: SX) -> tuple[SX, SX]:
    """Position of the overlap's middle along e1, measured from p_in, and half the length of the overlap, m. The half length is NaN
    if the parts do not overlap."""
    away, inner, outer = ca.dot(Ein[:, 0], s), 0.5 * both[0], 0.5 * both[1]
    low, high = ca.fmax(-inner, away - outer), ca.fmin(inner, away + outer)
    half = 0.5 * (high - low)
    return 0.5 * (low + high), half + TINY * ca.sqrt(half)


def on_pin_part(j: Joint, f: SX, t: SX, s: SX, Ein: SX, Eout: SX, both_lengths: SX | None = None) -> tuple[SX, SX]:
    """f_c, m_c (3×columns each) about the point of the part with the ends. With ``both_lengths``, m_c is about the middle of the
    overlap. f, t: force and torque on the outboard part at p_out. s, Ein, Eout: see ``Pose``."""
    E, both = pin_axes(j, Ein, Eout), CONTACTS[j.kind.friction].frame == "both"
    if both_lengths is not None:
        t = t + cross(s - overlap(s, Ein, both_lengths)[0] * Ein[:, 0], f)
    elif both or not j.fit.ends_out:
        t = t + cross(s, f)
    if both or not j.fit.pin_out:
        f, t = -f, -t
    return ca.sparsify(E.T @ f), ca.sparsify(E.T @ t)


def by_component(f: SX, t: SX) -> dict[str, SX]:
    """The rows of a force and a torque (3×columns each), by the name of the component."""
    return dict(zip(COMPONENTS, ca.vertsplit(ca.vertcat(f, t)), strict=True))


def pin_wrench(step: Step, j: Joint, N: SX, needs: tuple[str, ...], both_lengths: SX | None = None) -> SX:
    """The components ``needs`` of f_c, m_c of a tree joint. The entry of a span is 0. N: reaction on the joint's child at
    the child's origin (6×1)."""
    rows = by_component(*on_pin_part(j, *_of_child(j, N, step.s), step.s, step.Ein, step.Eout, both_lengths))
    return ca.sparsify(ca.vertcat(*[rows.get(n, SX(0)) for n in needs]))
