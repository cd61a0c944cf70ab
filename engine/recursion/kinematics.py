"""Positions and velocities from a body to the next (paper §2; METHOD, "Kinematics"), in the world frame.

Body i's reference origin is its joint definition point p_i, so c_i = 0 and the rotation centre d_i = r_i: Π = [P^s; P^r].
A joint is walked *forward* from its inboard part to its outboard part, or *backward* where the tree reaches its outboard part
first; its coordinates keep their meaning (outboard relative to inboard).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from engine.joints import Axis
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, basis_cross, cross, matrix, vector, zeros
from engine.system.leaves import Leaves
from engine.system.structure import GROUND, Joint


@dataclass
class Motion:
    """Position and velocity of a body: R (3×3), r (3), omega (3), rdot (3; velocity of the reference origin)."""

    R: SX
    r: SX
    omega: SX
    rdot: SX


@dataclass
class Step:
    """What tree joint i adds on the way from body j, which carries body i, to body i (1)–(14).

    Ein, Eout: the joint's inboard and outboard frame in the world (3×3); s = p_out − p_in in the world (3), ``travel`` the same in
    the inboard frame; lever = r_i − r_j (3); Pi: columns of Π of its free freedoms (6×n); w (6): (14), with the known
    accelerations of its prescribed freedoms; rates and coordinates: of all its freedoms, prescribed ones too.
    """

    joint: Joint
    Ein: SX
    Eout: SX
    s: SX
    travel: list[SX]
    lever: SX
    Pi: SX
    w: SX
    rates: list[SX]
    coordinates: list[SX]


GROUND_MOTION = Motion(SX.eye(3), zeros(3), zeros(3), zeros(3))


def axes_of(sym: Symbols, frame: Leaves) -> SX:
    """A joint frame in its body (3×3) from 9 row-major numbers, which are structure; those of a part are its parameters."""
    return matrix([[sym.leaf(x) for x in frame[k : k + 3]] for k in (0, 3, 6)])


def axis_world(axis: Axis, Ein: SX, Eout: SX) -> SX:
    """The unit vector of a motion axis in the world."""
    return (Ein if axis.side == "in" else Eout)[:, axis.index]


def walk(sym: Symbols, j: Joint, parent: Motion) -> tuple[Motion, Step]:
    """Motion of the body that tree joint j carries, from that of the body it is carried by, and what the joint adds."""
    q, rates = sym.coordinates(j), sym.rates(j)
    pitch = sym.leaf(j.pitch) / (2 * ca.pi) if j.pitch is not None else SX(1)
    Rq = matrix(j.kind.rotation(q, ca))
    travel = [pitch * s if j.pitch is not None else s for s in j.kind.travel(q)]
    if j.forward:
        Ein = parent.R @ axes_of(sym, j.inb_frame)
        Eout = Ein @ Rq
        R = Eout @ axes_of(sym, j.out_frame).T
        d = parent.R @ sym.leaves(j.inb_point)
    else:
        Eout = parent.R @ axes_of(sym, j.out_frame)
        Ein = Eout @ Rq.T
        R = Ein @ axes_of(sym, j.inb_frame).T
        d = parent.R @ sym.leaves(j.out_point)
    s = Ein @ vector(travel)
    sign = 1 if j.forward else -1
    lever = d + sign * s
    spin = sum((axis_world(a, Ein, Eout) * rates[k] for k, a in _axes(j, True)), zeros(3))
    slide = sum((_scaled(a, Ein, Eout, pitch) * rates[k] for k, a in _axes(j, False)), zeros(3))
    omega = parent.omega + sign * spin
    rdot = parent.rdot + cross(parent.omega, lever) + (slide if j.forward else -slide + cross(spin, s))
    sigma = _sigma(j, Ein, Eout, rates, parent.omega, omega)
    gamma = _gamma(j, parent.omega, omega, d, s, slide, sigma)
    columns = [_column(j, k, Ein, Eout, travel, pitch) for k in range(j.kind.nv)]
    w = ca.vertcat(gamma, sign * sigma)
    for k, acceleration in sym.driven_accelerations(j).items():
        w = w + columns[k] * acceleration
    Pi = ca.sparsify(ca.horzcat(zeros(6, 0), *[columns[k] for k in j.free]))
    return (
        Motion(ca.sparsify(R), parent.r + lever, ca.sparsify(omega), ca.sparsify(rdot)),
        Step(j, ca.sparsify(Ein), ca.sparsify(Eout), s, travel, ca.sparsify(lever), Pi, ca.sparsify(w), rates, q),
    )


def _axes(j: Joint, rot: bool) -> list[tuple[int, Axis]]:
    """All turning axes of a joint (``rot``) or all sliding ones, each with the number of its freedom."""
    return [(k, a) for k, axes in enumerate(j.kind.axes) for a in axes if a.rot == rot]


def _scaled(a: Axis, Ein: SX, Eout: SX, pitch: SX) -> SX:
    """A sliding axis in the world; that of a screw times its travel per angle."""
    v = axis_world(a, Ein, Eout)
    return v * pitch if a.by_pitch else v


def _column(j: Joint, k: int, Ein: SX, Eout: SX, travel: list[SX], pitch: SX) -> SX:
    """Column k of Π (7), [P^s; P^r]; of a joint walked backward [−P^s + P^r × s; −P^r]."""
    top, bottom = zeros(3), zeros(3)
    for a in j.kind.axes[k]:
        v = axis_world(a, Ein, Eout)
        if not a.rot:
            top = top + (1 if j.forward else -1) * _scaled(a, Ein, Eout, pitch)
            continue
        bottom = bottom + (v if j.forward else -v)
        if not j.forward and a.side == "in":
            for m in range(3):
                sign, n = basis_cross(a.index, m)
                if sign:
                    top = top + sign * travel[m] * Ein[:, n]
    return ca.sparsify(ca.vertcat(top, bottom))


def _sigma(j: Joint, Ein: SX, Eout: SX, rates: list[SX], inner: SX, outer: SX) -> SX:
    """σ (10), of the outboard part relative to the inboard one: the sum over turning axes of (ω of the part that carries the axis)
    × axis · rate. inner, outer: ω of the body that is walked from and of the one walked to. The axis of a joint that has only one
    is fixed in both parts, so the known ω of the first serves."""
    omega = {"in": inner if j.forward else outer, "out": outer if j.forward else inner}
    out = zeros(3)
    for k, a in _axes(j, True):
        carrier = inner if a.side == "in" and len(_axes(j, True)) == 1 else omega[a.side]
        out = out + cross(carrier, axis_world(a, Ein, Eout) * rates[k])
    return out


def _gamma(j: Joint, parent: SX, child: SX, d: SX, s: SX, slide: SX, sigma: SX) -> SX:
    """γ of (14), by (12) with the rotation centre at p_i; of a joint walked backward its mirror image."""
    if j.forward:
        return cross(parent, cross(parent, d + s)) + 2 * cross(parent, slide)
    return cross(parent, cross(parent, d)) - 2 * cross(child, slide) + cross(sigma, s) - cross(child, cross(child, s))


def point_motion(motions: Sequence[Motion] | Mapping[int, Motion], body: int, lever: SX) -> tuple[SX, SX]:
    """Position and velocity (world, 3 each) of a point that lies at ``lever`` from a body's reference origin, or on the ground."""
    m = GROUND_MOTION if body == GROUND else motions[body]
    return m.r + lever, m.rdot + cross(m.omega, lever)
