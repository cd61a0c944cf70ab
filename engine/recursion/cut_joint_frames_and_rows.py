"""Frames, levers and constraint rows of cut joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from functools import wraps
from typing import Any, TypeVar

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.recursion.body_kinematics import Motion
from trunnion.recursion.vector_algebra import SX, cross, zeros
from trunnion.system.structure.bodies_and_joints import Joint

Moving = tuple[SX, SX]
"""A vector (3) or a scalar, and its rate."""
NOTHING: Moving = (zeros(3), zeros(3))


@dataclass
class Row:
    """One constraint of a cut joint.

    phi, rate     residual φ and its time derivative.
    g_in, g_out   transposed rows G on the inboard and outboard body (6×1 each).
    xi            ξ, the second time derivative of φ at Ż = 0.
    leader        only in a coupling: transposed rows on the two bodies of the leading joint."""

    phi: SX
    rate: SX
    g_in: SX
    g_out: SX
    xi: SX
    leader: tuple[SX, SX] | None = None

    @property
    def on(self) -> tuple[SX, ...]:
        """The transposed rows on all bodies of the constraint, in the order of ``Joint.ends``."""
        return (self.g_in, self.g_out, *(self.leader or ()))


@dataclass
class Cut:
    """A cut joint in the world frame.

    Ein, Eout     inboard and outboard joint frame (3×3).
    c_in, c_out   vector from each body's reference origin to its joint point (3), m.
    inb, out      motions of the two bodies.
    s             p_out − p_in (3), m.
    made          results that the decorator ``once`` stores, by function name."""

    joint: Joint
    Ein: SX
    Eout: SX
    c_in: SX
    c_out: SX
    inb: Motion
    out: Motion
    s: SX
    rows: list[Row]
    made: dict[str, Any] = field(default_factory=dict)


T = TypeVar("T")


def once(build: Callable[[Cut], T]) -> Callable[[Cut], T]:
    """Decorator: the first call builds an expression of a cut joint; later calls return the same expression."""

    @wraps(build)
    def kept(c: Cut) -> T:
        if build.__name__ not in c.made:
            c.made[build.__name__] = build(c)
        return c.made[build.__name__]

    return kept


@once
def point_velocity(c: Cut) -> SX:
    """Velocity of the outboard joint point relative to the inboard joint point, world (3), m/s."""
    return c.out.rdot + cross(c.out.omega, c.c_out) - c.inb.rdot - cross(c.inb.omega, c.c_in)


def force_row(
    c: Cut, phi: SX, push: Moving, arm_in: Moving, arm_out: Moving, torque_in: Moving = NOTHING, torque_out: Moving = NOTHING
) -> Row:
    """Row of a multiplier λ. The multiplier applies the force λ·push to the outboard part and −λ·push to the inboard part. arm_in,
    arm_out: vectors from each part's origin to the point of the force. The multiplier also applies the torques λ·torque_in and
    λ·torque_out. phi: the residual."""
    (k, kdot), (x_in, x_in_dot), (x_out, x_out_dot) = push, arm_in, arm_out
    velocity = c.out.rdot + cross(c.out.omega, x_out) - c.inb.rdot - cross(c.inb.omega, x_in)
    bend = cross(c.out.omega, x_out_dot) - cross(c.inb.omega, x_in_dot)
    turning, turned = (ca.dot(torque_out[i], c.out.omega) + ca.dot(torque_in[i], c.inb.omega) for i in (0, 1))
    return Row(
        phi, ca.dot(k, velocity) + turning,
        ca.sparsify(ca.vertcat(-k, torque_in[0] - cross(x_in, k))), ca.sparsify(ca.vertcat(k, torque_out[0] + cross(x_out, k))),
        ca.dot(kdot, velocity) + ca.dot(k, bend) + turned,
    )  # fmt: skip
