"""Constraint of a worm and its wheel (theory, "Worms"): no relative motion of their flanks across the thread.

a, b: axes of worm and wheel. u: direction from the worm's axis to the wheel's axis, ±(a × b); the sign is ``side``. The pitch point
is on the common perpendicular of the axes, at the worm's pitch radius. At this point, the thread has the direction d = sin γ a +
cos γ a × u. In the plane of a and a × u, the flank of the thread has the normal k = cos γ a − sin γ a × u."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints.wheel_pairs import side
from trunnion.recursion.cut_joint_frames_and_rows import Cut, Moving, Row, force_row, point_velocity
from trunnion.recursion.vector_algebra import SX, cross


@dataclass
class Pitch:
    """The pitch point of a worm: axis a, directions u and w = a × u, and the arms of the point from the origins of both parts. Each
    vector has its rate."""

    a: Moving
    u: Moving
    w: Moving
    arm_in: Moving
    arm_out: Moving

    def mixed(self, by_axis: SX, by_circle: SX) -> Moving:
        """The vector by_axis · a + by_circle · w."""
        return by_axis * self.a[0] + by_circle * self.w[0], by_axis * self.a[1] + by_circle * self.w[1]

    def row(self, c: Cut, phi: SX, push: Moving) -> Row:
        """The row of a force along ``push`` at the pitch point."""
        return force_row(c, phi, push, self.arm_in, self.arm_out)


def pitch(c: Cut, r1: SX, r2: SX, axes: tuple[Moving, Moving], product: Callable[[Moving, Moving], Moving]) -> Pitch:
    """The pitch point. r1, r2: pitch radii; product: cross product with its rate."""
    a, b = axes
    one, two, between = ([v[i] for i in range(3)] for v in (a[0], b[0], c.s))
    sign, n = side(one, two, between, ca), product(a, b)
    u = sign * n[0], sign * n[1]
    sdot = point_velocity(c)
    along = [(ca.dot(c.s, v[0]), ca.dot(sdot, v[0]) + ca.dot(c.s, v[1])) for v in (a, b)]
    (h, hdot), (g, gdot) = along
    arm_in = c.c_in + h * a[0] + r1 * u[0], cross(c.inb.omega, c.c_in) + hdot * a[0] + h * a[1] + r1 * u[1]
    arm_out = c.c_out - g * b[0] - r2 * u[0], cross(c.out.omega, c.c_out) - gdot * b[0] - g * b[1] - r2 * u[1]
    return Pitch(a, u, product(a, u), arm_in, arm_out)
