"""Constraint equations of cut joints (paper §4): residuals (46), (49), rows G (47), (50), ξ (48), (51), and rates.

S is symmetric, because the transpose of a row G is the force column W^N (59), (61) of the row's multiplier (theory, "Cut
joints")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca

from trunnion.recursion.body_kinematics import Motion, axes_of, axis_world, motions_of
from trunnion.recursion.cam_follower_constraint import following_row
from trunnion.recursion.cut_joint_frames_and_rows import Cut as Cut
from trunnion.recursion.cut_joint_frames_and_rows import Row as Row
from trunnion.recursion.cut_joint_frames_and_rows import once, point_velocity
from trunnion.recursion.pin_in_slot_constraint import slot_row
from trunnion.recursion.point_on_curve_constraint import curve_row
from trunnion.recursion.rod_constraint import rod_row
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross, zeros
from trunnion.recursion.wheel_pair_constraint import rolling_freedoms, rolling_row, worm_frame
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.coupling_joint_data import Mimic

FREEDOMS = "freedoms"
"""Key in ``Cut.made``: the freedoms of a bodiless joint, as rows."""
ALONG = "along"
"""Key in ``Cut.made``: the coordinate of a point along its curve."""


INSIDE = "inside"
"""Key in ``Cut.made``: the distance or angle of a contact inside the free ends of its wall."""


def cut(sym: Symbols, motions: list[Motion], j: Joint) -> Cut:
    """A cut joint with its constraint rows. A coupling has a single row, which ties the freedom of the follower to that of the
    leader."""
    made = locate_cut(sym, motions_of(motions, (j.inb, j.out)), j)
    if j.light is not None:
        made.rows.append(Row(SX(0), SX(0), zeros(6), zeros(6), SX(0)))  # a row of zeros, because ``inward_reduction`` applies λ
        return made
    if j.mimic is None:
        add_rows(sym, made)
        return made
    lead, follow = (sym.system.tree[i] for i in (j.mimic.leader, j.mimic.follower))
    leads = locate_cut(sym, motions_of(motions, (lead.inb, lead.out)), lead)
    of = [(sym.coordinates(x)[0], sym.rates(x)[0]) for x in (follow, lead)]
    add_tie(sym, made, replace(made, joint=follow), leads, of, j.mimic)
    return made


def add_tie(sym: Symbols, c: Cut, follows: Cut, leads: Cut, of: list[tuple[SX, SX]], m: Mimic) -> None:
    """Set the row of a coupling. For a gearbox, also set the freedom of the coupling: the follower's freedom. The row of a gearbox
    is the ratio times the angle of the output shaft, minus the angle of the input shaft. The multiplier of this row is the torque
    of the input shaft."""
    geared = c.joint.kind.nv > 0
    c.rows = [mimic_row(sym, follows, leads, of, m, geared)]
    if geared:
        c.made[FREEDOMS] = [Row(SX(0), of[0][1], *axis_wrenches(follows, 0), acceleration_bias(follows, 0))]


def locate_cut(sym: Symbols, both: Sequence[Motion], j: Joint) -> Cut:
    """Frames and levers of a cut joint, without rows. both: motions of the inboard and the outboard part."""
    inb, out = both
    Ein, Eout = ca.sparsify(inb.R @ axes_of(sym, j.inb_frame)), ca.sparsify(out.R @ axes_of(sym, j.out_frame))
    c_in, c_out = ca.sparsify(inb.R @ sym.leaves(j.inb_point)), ca.sparsify(out.R @ sym.leaves(j.out_point))
    s = ca.sparsify(out.r + c_out - inb.r - c_in)
    return Cut(j, Ein, Eout, c_in, c_out, inb, out, s, [])


def add_rows(sym: Symbols, c: Cut) -> None:
    """Set the constraint rows of a cut joint: first the translational rows, then the rotational rows, then the row of wheels, of
    a rod or of a follower. For a worm or a follower, also set Ein to the contact frame."""
    kind = c.joint.kind
    c.rows = [_travel_row(c, k) for k in kind.rows_s] + [_turn_row(c, m, k) for m, k in kind.rows_r]
    if kind.rolls:
        c.rows += [] if kind.slips else [rolling_row(sym, c)]
        c.made[FREEDOMS] = rolling_freedoms(sym, c) if kind.nv else []
        if kind.rolls.touch == "skew":
            c.Ein = worm_frame(sym, c)
    if kind.keeps_distance:
        c.rows.append(rod_row(sym, c))
        c.made[FREEDOMS] = []
    if kind.plays:
        row, slides, c.Ein, inside = slot_row(sym, c)
        c.made |= {FREEDOMS: [slides], INSIDE: inside}
        c.rows.append(row)
    elif kind.follows == "curve":
        row, slides, c.Ein, way, inside = curve_row(sym, c)
        c.made |= {FREEDOMS: [slides], ALONG: [way], INSIDE: inside}
        c.rows.append(row)
    elif kind.follows:
        row, slides, c.Ein, inside = following_row(sym, c)
        c.made |= {FREEDOMS: [slides], INSIDE: inside}
        c.rows.append(row)


@once
def _centripetal(c: Cut) -> SX:
    """Acceleration of the outboard joint point relative to the inboard joint point, if Ż = 0 for both bodies."""
    return cross(c.out.omega, cross(c.out.omega, c.c_out)) - cross(c.inb.omega, cross(c.inb.omega, c.c_in))


def _travel_row(c: Cut, k: int) -> Row:
    """Row of a translational constraint (49)–(51): no travel along an axis h.

    If all three directions are constrained, h is fixed in the world. Otherwise h is fixed in the outboard part if this part is the
    ground, else in the inboard part. (The generated code is shorter if the axis does not rotate.)"""
    vel, acc = point_velocity(c), _centripetal(c)
    if len(c.joint.kind.rows_s) == 3:
        h, omega, arm_in, arm_out = SX.eye(3)[:, k], zeros(3), c.c_in, c.c_out
    elif c.joint.out == GROUND:
        h, omega, arm_in, arm_out = c.Eout[:, k], c.out.omega, c.c_in, c.c_out - c.s
    else:
        h, omega, arm_in, arm_out = c.Ein[:, k], c.inb.omega, c.c_in + c.s, c.c_out
    hdot = cross(omega, h)
    xi = ca.dot(acc, h) + 2 * ca.dot(vel, hdot) + ca.dot(c.s, cross(omega, hdot))
    return Row(
        ca.dot(c.s, h),
        ca.dot(vel, h) + ca.dot(c.s, hdot),
        -ca.sparsify(ca.vertcat(h, cross(arm_in, h))),
        ca.sparsify(ca.vertcat(h, cross(arm_out, h))),
        xi,
    )


def _turn_row(c: Cut, m: int, k: int) -> Row:
    """Row of a rotational constraint (46)–(48): inboard axis m stays perpendicular to outboard axis k."""
    a, b = c.Ein[:, m], c.Eout[:, k]
    ab, rel = cross(a, b), ca.sparsify(c.inb.omega - c.out.omega)
    xi = ca.dot(rel, cross(cross(c.inb.omega, a), b) + cross(a, cross(c.out.omega, b)))
    g = ca.sparsify(ca.vertcat(zeros(3), ab))
    return Row(ca.dot(a, b), ca.dot(rel, ab), g, -g, xi)


@once
def rates(c: Cut) -> list[SX]:
    """Rates of a cut joint's freedoms, valid while the loop is closed. Rotation: (ω_out − ω_in)·axis. Translation: relative
    velocity of the joint points along the axis."""
    if c.joint.kind.bodiless:
        return [f.rate for f in c.made[FREEDOMS]]
    turn = ca.sparsify(c.out.omega - c.inb.omega)
    slide = point_velocity(c) - cross(c.inb.omega, c.s)
    return [ca.dot(turn if a.rot else slide, axis_world(a, c.Ein, c.Eout)) for (a,) in c.joint.kind.axes]


def mimic_row(sym: Symbols, follows: Cut, leads: Cut, of: list[tuple[SX, SX]], m: Mimic, geared: bool = False) -> Row:
    """Row of a coupling: q_follower = ratio · q_leader + offset, or with ``geared`` ratio · q_follower = q_leader + offset. of:
    (coordinate, rate) of the follower and of the leader."""
    (q, v), (q_lead, v_lead) = of
    own, ratio = (sym.leaf(m.ratio), SX(1)) if geared else (SX(1), sym.leaf(m.ratio))
    (on_in, on_out), (lead_in, lead_out) = (axis_wrenches(c, 0) for c in (follows, leads))
    xi = own * acceleration_bias(follows, 0) - ratio * acceleration_bias(leads, 0)
    led = (-ratio * lead_in, -ratio * lead_out)
    phi, rate = own * q - ratio * q_lead - sym.leaf(m.offset), own * v - ratio * v_lead
    return Row(phi, rate, own * on_in, own * on_out, xi, led)


def axis_wrenches(c: Cut, freedom: int) -> tuple[SX, SX]:
    """Wrenches on the inboard and outboard body (6×1 at their origins) of a unit effort that acts on the outboard part along a
    freedom."""
    if c.joint.kind.bodiless:
        return c.made[FREEDOMS][freedom].g_in, c.made[FREEDOMS][freedom].g_out
    a = c.joint.kind.axes[freedom][0]  # the second axis of a screw is the travel that the rotation causes
    h = axis_world(a, c.Ein, c.Eout)
    if a.rot:
        w = ca.sparsify(ca.vertcat(zeros(3), h))
        return -w, w
    return -ca.sparsify(ca.vertcat(h, cross(c.c_in + c.s, h))), ca.sparsify(ca.vertcat(h, cross(c.c_out, h)))


def acceleration_bias(c: Cut, freedom: int) -> SX:
    """Acceleration of a cut joint's freedom if Ż = 0 for both bodies. The contribution of Ż is the transposed ``axis_wrenches``
    times Ż."""
    if c.joint.kind.bodiless:
        return c.made[FREEDOMS][freedom].xi
    a = c.joint.kind.axes[freedom][0]  # the second axis of a screw is the travel that the rotation causes
    h = axis_world(a, c.Ein, c.Eout)
    carrier = c.inb.omega if a.side == "in" else c.out.omega
    hdot = cross(carrier, h)
    if a.rot:
        return ca.dot(ca.sparsify(c.out.omega - c.inb.omega), hdot)
    v = point_velocity(c)
    return ca.dot(_centripetal(c), h) + 2 * ca.dot(v, hdot) + ca.dot(c.s, cross(carrier, hdot))


@once
def coordinates(c: Cut) -> list[SX]:
    """Coordinates of a cut joint, valid while the loop is closed. Angles are within ±π; a quaternion's scalar part is ≥ 0."""
    if ALONG in c.made:
        return c.made[ALONG]
    rel, s = c.Ein.T @ c.Eout, c.Ein.T @ c.s
    return c.joint.kind.measure([[rel[i, k] for k in range(3)] for i in range(3)], [s[k] for k in range(3)], ca)
