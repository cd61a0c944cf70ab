"""Positions and velocities from one body to the next (paper §2; theory, "Kinematics"), in the world frame.

Body i's reference origin is its joint definition point p_i. Therefore c_i = 0, the rotation centre is d_i = r_i, and Π = [P^s;
P^r]. The recursion crosses a joint *forward* from its inboard to its outboard part, or *backward*. Coordinates always describe the
outboard part relative to the inboard part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import Axis
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross, matrix, vector, zeros
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.parameter_table import Leaves


@dataclass
class Motion:
    """Position and velocity of a body: R (3×3), r (3), omega (3), rdot (3; velocity of the reference origin)."""

    R: SX
    r: SX
    omega: SX
    rdot: SX


class Pose(NamedTuple):
    """Pose of a joint: inboard and outboard joint frame Ein, Eout in the world (3×3), and s = p_out − p_in (3), m."""

    Ein: SX
    Eout: SX
    s: SX


@dataclass
class Step:
    """Step from body j over tree joint i to body i (1)–(14).

    Ein, Eout    inboard and outboard joint frame in the world (3×3).
    s            p_out − p_in in the world (3), m; ``travel`` is the same vector in the inboard joint frame.
    lever        r_i − r_j (3), m.
    Pi           columns of Π for the free freedoms (6×n).
    w            acceleration (14) if Ż_j = 0 and q̈ = 0, with the accelerations of prescribed freedoms (6).
    rates        of all freedoms, free and prescribed.
    coordinates  of all freedoms, free and prescribed."""

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
    """A joint frame in its body (3×3), from 9 row-major values."""
    return matrix([[sym.leaf(x) for x in frame[k : k + 3]] for k in (0, 3, 6)])


def axis_world(axis: Axis, Ein: SX, Eout: SX) -> SX:
    """Unit vector of a motion axis in the world."""
    return (Ein if axis.side == "in" else Eout)[:, axis.index]


def walk(sym: Symbols, j: Joint, parent: Motion) -> tuple[Motion, Step]:
    """Motion of the body that tree joint j carries, and the step over j. parent: motion of the body where the step starts."""
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
    """(freedom, axis) for every rotation axis of a joint if ``rot``, otherwise for every translation axis."""
    return [(k, a) for k, axes in enumerate(j.kind.axes) for a in axes if a.rot == rot]


def _scaled(a: Axis, Ein: SX, Eout: SX, pitch: SX) -> SX:
    """A translation axis in the world. The axis of a screw's translation is multiplied by the travel per angle."""
    v = axis_world(a, Ein, Eout)
    return v * pitch if a.by_pitch else v


def _column(j: Joint, k: int, Ein: SX, Eout: SX, travel: list[SX], pitch: SX) -> SX:
    """Column k of Π (7): [P^s; P^r] for a forward step, [−P^s + P^r × s; −P^r] for a backward step."""
    top, bottom = zeros(3), zeros(3)
    for a in j.kind.axes[k]:
        v = axis_world(a, Ein, Eout)
        if not a.rot:
            top = top + (1 if j.forward else -1) * _scaled(a, Ein, Eout, pitch)
            continue
        bottom = bottom + (v if j.forward else -v)
        if not j.forward and a.side == "in":
            for m in (m for m in range(3) if m != a.index):  # e_index × e_m = ± e_n
                sign, n = 1 if (m - a.index) % 3 == 1 else -1, 3 - a.index - m
                top = top + sign * travel[m] * Ein[:, n]
    return ca.sparsify(ca.vertcat(top, bottom))


def _sigma(j: Joint, Ein: SX, Eout: SX, rates: list[SX], inner: SX, outer: SX) -> SX:
    """Angular acceleration σ (10) of the outboard part relative to the inboard part at constant rates. σ = Σ ω_c × (axis · rate)
    over all rotation axes, where ω_c is the angular velocity of the part that carries the axis.

    inner: ω of the body where the step starts. outer: ω of the body where the step ends. A single rotation axis is fixed in both
    parts; ω_c may then be inner or outer."""
    omega = {"in": inner if j.forward else outer, "out": outer if j.forward else inner}
    out = zeros(3)
    for k, a in _axes(j, True):
        carrier = inner if a.side == "in" and len(_axes(j, True)) == 1 else omega[a.side]
        out = out + cross(carrier, axis_world(a, Ein, Eout) * rates[k])
    return out


def _gamma(j: Joint, parent: SX, child: SX, d: SX, s: SX, slide: SX, sigma: SX) -> SX:
    """γ of (14). A forward step uses (12) with the rotation centre at p_i; a backward step uses the inverse motion."""
    if j.forward:
        return cross(parent, cross(parent, d + s)) + 2 * cross(parent, slide)
    return cross(parent, cross(parent, d)) - 2 * cross(child, slide) + cross(sigma, s) - cross(child, cross(child, s))


def point_motion(m: Motion, lever: SX) -> tuple[SX, SX]:
    """Position and velocity (world, 3 each) of a body's point. lever: vector from the reference origin to the point, world."""
    return m.r + lever, m.rdot + cross(m.omega, lever)


def motions_of(motions: Sequence[Motion] | Mapping[int, Motion], bodies: Sequence[int]) -> tuple[Motion, ...]:
    """The motion of each of the given bodies, which may include the ground."""
    return tuple(GROUND_MOTION if b == GROUND else motions[b] for b in bodies)
