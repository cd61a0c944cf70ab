"""What is kept of a cut joint: its frames, levers, and constraint rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, TypeVar

import casadi as ca

from engine.recursion.kinematics import Motion
from engine.recursion.vectors import SX, cross, zeros
from engine.system.structure import Joint

Moving = tuple[SX, SX]
"""A vector (3) or a number, and its rate."""
NOTHING: Moving = (zeros(3), zeros(3))


@dataclass
class Row:
    """One constraint of a cut joint: its residual φ, the rate of φ, its row G on the inboard and the outboard body (transposed, 6×1
    each), and ξ, the second rate of φ when both bodies' Ż vanish. leader: of a freedom that follows another, its rows on the two
    bodies of the joint that leads, too."""

    phi: SX
    rate: SX
    g_in: SX
    g_out: SX
    xi: SX
    leader: tuple[SX, SX] | None = None

    @property
    def on(self) -> tuple[SX, ...]:
        """Its rows on the bodies that it is on (``Joint.ends``)."""
        return (self.g_in, self.g_out, *(self.leader or ()))


@dataclass
class Cut:
    """A cut joint in the world. Ein, Eout: its frames (3×3); c_in, c_out: from each body's reference origin to the joint's point on
    it (3); inb, out: motions of the two bodies; s = p_out − p_in (3)."""

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
    """A function of a cut joint that is asked for often and built once."""

    @wraps(build)
    def kept(c: Cut) -> T:
        if build.__name__ not in c.made:
            c.made[build.__name__] = build(c)
        return c.made[build.__name__]

    return kept


@once
def point_velocity(c: Cut) -> SX:
    """Velocity of the outboard joint point relative to the inboard one."""
    return c.out.rdot + cross(c.out.omega, c.c_out) - c.inb.rdot - cross(c.inb.omega, c.c_in)


def pushed(
    c: Cut, phi: SX, push: Moving, arm_in: Moving, arm_out: Moving, torque_in: Moving = NOTHING, torque_out: Moving = NOTHING
) -> Row:
    """The row whose multiplier pushes the outboard part along ``push`` at an arm from its origin and the inboard one back,
    and turns both by torques."""
    (k, kdot), (x_in, x_in_dot), (x_out, x_out_dot) = push, arm_in, arm_out
    velocity = c.out.rdot + cross(c.out.omega, x_out) - c.inb.rdot - cross(c.inb.omega, x_in)
    bend = cross(c.out.omega, x_out_dot) - cross(c.inb.omega, x_in_dot)
    turning, turned = (ca.dot(torque_out[i], c.out.omega) + ca.dot(torque_in[i], c.inb.omega) for i in (0, 1))
    return Row(
        phi, ca.dot(k, velocity) + turning,
        ca.sparsify(ca.vertcat(-k, torque_in[0] - cross(x_in, k))), ca.sparsify(ca.vertcat(k, torque_out[0] + cross(x_out, k))),
        ca.dot(kdot, velocity) + ca.dot(k, bend) + turned,
    )  # fmt: skip
