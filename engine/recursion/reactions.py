"""Joint reactions (57)–(66), (71), (103): all that a joint transmits, at the point and in the frame where it is wanted (METHOD,
"Reactions")."""

from __future__ import annotations

import casadi as ca

from engine.basics.interrupts import heed
from engine.contact import REGISTRY as CONTACTS
from engine.contact.base import OVERLAP, TINY
from engine.contact.journal import LENGTHS
from engine.recursion import cuts as cutting
from engine.recursion.accelerations import Accelerations
from engine.recursion.kinematics import Step
from engine.recursion.reduction import Model
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, cross, zeros
from engine.system.structure import Joint


def on_outboard(m: Model, acc: Accelerations, j: Joint, combine: SX | None = None) -> tuple[SX, SX, SX]:
    """The total wrench on the outboard part at p_out, as force and torque in the world (3×columns each), and s = p_out − p_in
    (3)."""
    heed()
    if j.cut:
        c = m.cuts[_cut_index(m, j)]
        W = ca.sparsify(_cut_wrench(m, c) if combine is None else _cut_wrench(m, c) @ combine)
        return W[:3, :], W[3:, :], c.s
    step, N = m.steps[j.child], acc.N[j.child]
    f, t, s = N[:3, :], N[3:, :], step.s
    if j.forward:
        return f, t, s
    return -f, -(t - cross(s, f)), s


def _cut_index(m: Model, j: Joint) -> int:
    return next(i for i, c in enumerate(m.cuts) if c.joint.name == j.name)


def _cut_wrench(m: Model, c: cutting.Cut) -> SX:
    """Wrench of a cut joint on its outboard part at p_out (6×columns), by (59)–(62): its multipliers on their axes, its devices
    among what is known, its friction opposite to η, which is what acts on the inboard part."""
    j = c.joint
    W = zeros(6, m.columns)
    for k, row in enumerate(c.rows):
        W[:, 1 + j.rows + k] += at_point(row.g_out, c.c_out)
    from engine.recursion.loads import device_force
    from engine.recursion.reduction import eta_column

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
    """A wrench about a body's origin, about the point at ``lever`` from it instead."""
    return ca.sparsify(ca.vertcat(wrench[:3, :], wrench[3:, :] - cross(lever, wrench[:3, :])))


def _holder(m: Model, j: Joint) -> cutting.Cut | Step:
    return m.cuts[_cut_index(m, j)] if j.cut else m.steps[j.child]


def frames(m: Model, j: Joint) -> tuple[SX, SX]:
    """Inboard and outboard joint frame in the world."""
    holder = _holder(m, j)
    return holder.Ein, holder.Eout


def span(m: Model, j: Joint, columns: int) -> SX:
    """Half the length over which a joint's parts overlap, m, as a row of the affine maps: no multiplier changes it."""
    both, holder = lengths(m.sym, j), _holder(m, j)
    assert both is not None
    return ca.horzcat(overlap(holder.s, holder.Ein, both)[1], SX(1, columns - 1))


def pin_frame(m: Model, j: Joint) -> SX:
    """Axes in which f_c, m_c of a frictional joint are measured (``ContactElement.frame``)."""
    return pin_axes(j, *frames(m, j))


def pin_axes(j: Joint, Ein: SX, Eout: SX) -> SX:
    """The same, of a joint with these frames."""
    frame = CONTACTS[j.kind.friction].frame
    if frame == "both":
        u1, u2 = Ein[:, 0], Eout[:, 1]
        return ca.sparsify(ca.horzcat(u1, u2, cross(u1, u2)))
    return Eout if j.fit.pin_out and frame == "pin" else Ein


def on_pin(m: Model, acc: Accelerations, j: Joint, combine: SX | None = None) -> tuple[SX, SX]:
    """f_c, m_c (3×columns each): the total wrench on the part that carries the pin, where the ends are, in ``pin_frame``. That of a
    universal joint is always the one on the inboard part: which part carries which journal is the contact element's business."""
    f, t, s = on_outboard(m, acc, j, combine)
    return pinned(j, f, t, s, *frames(m, j), lengths(m.sym, j))


def lengths(sym: Symbols, j: Joint) -> SX | None:
    """Lengths of the inboard and the outboard part (2), m, of a joint whose parts touch where they overlap."""
    if j.fit.ends != OVERLAP or not j.friction:
        return None
    return ca.vertcat(*[sym.leaf(j.friction.number(s.name)) for s in LENGTHS])


def overlap(s: SX, Ein: SX, both: SX) -> tuple[SX, SX]:
    """Where the middle of what overlaps is, along e1 from p_in, and half its length, m; no number where nothing overlaps."""
    away, inner, outer = ca.dot(Ein[:, 0], s), 0.5 * both[0], 0.5 * both[1]
    low, high = ca.fmax(-inner, away - outer), ca.fmin(inner, away + outer)
    half = 0.5 * (high - low)
    return 0.5 * (low + high), half + TINY * ca.sqrt(half)


def pinned(j: Joint, f: SX, t: SX, s: SX, Ein: SX, Eout: SX, both_lengths: SX | None = None) -> tuple[SX, SX]:
    """f_c, m_c (3×columns each), at the point of the part that has the ends (or amid what overlaps: ``lengths``), from force and
    torque on the outboard part at p_out, s = p_out − p_in and the joint's frames."""
    E, both = pin_axes(j, Ein, Eout), CONTACTS[j.kind.friction].frame == "both"
    if both_lengths is not None:
        t = t + cross(s - overlap(s, Ein, both_lengths)[0] * Ein[:, 0], f)
    elif both or not j.fit.ends_out:
        t = t + cross(s, f)
    if both or not j.fit.pin_out:
        f, t = -f, -t
    return ca.sparsify(E.T @ f), ca.sparsify(E.T @ t)


def pin_wrench(step: Step, j: Joint, N: SX, needs: tuple[str, ...], both_lengths: SX | None = None) -> SX:
    """The needed components of f_c, m_c of a tree joint from N (6×1, on its child at the child's reference origin); 0 for
    the span."""
    f, t, s = N[:3], N[3:], step.s
    if not j.forward:
        f, t = -f, -(t - cross(s, f))
    fc, mc = pinned(j, f, t, s, step.Ein, step.Eout, both_lengths)
    rows = {**{f"f{k + 1}": fc[k] for k in range(3)}, **{f"m{k + 1}": mc[k] for k in range(3)}}
    return ca.sparsify(ca.vertcat(*[rows.get(n, SX(0)) for n in needs]))


def on_inboard(m: Model, acc: Accelerations, j: Joint, combine: SX) -> tuple[SX, SX]:
    """The reported reaction: on the inboard part, at the joint centre (the pin's point), in the inboard joint frame."""
    f, t, s = on_outboard(m, acc, j, combine)
    Ein = frames(m, j)[0]
    t = t if j.fit.pin_out else t + cross(s, f)
    return ca.sparsify(-(Ein.T @ f)), ca.sparsify(-(Ein.T @ t))
