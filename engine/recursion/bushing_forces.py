"""Bushings: stiffness and damping in all six directions between two bodies, in axes of the first body (theory, "Bushings").

E and E_b are the bushing's axes on the first and second body, δ = Eᵀ(x_b − x_a) and Q = Eᵀ E_b. The force on the second body is
−(K δ + C δ̇). The elastic torque on the second body is minus the gradient of Σ 2 k_i v_i², where v is the vector part of Q's
quaternion. All products in this gradient are sums of entries of Q. The code therefore needs no division, and the quaternion's sign
has no effect."""

from __future__ import annotations

import casadi as ca

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints.joint_kind import to_quaternion
from trunnion.recursion.body_kinematics import Motion, motions_of, point_motion
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX, cross, row_major
from trunnion.system.structure.bodies_and_joints import GROUND, Load

SMALL = 1e-20
"""Limit of the squared norm of the vector part of a quaternion. Below this limit, twice the norm equals the rotation angle to the
last digit."""


@dataclass
class Bushing:
    """State of a bushing. Vectors are in the bushing's axes on the first body, unless stated otherwise.

    offset, rate    vector from the first to the second point, m, and its time derivative.
    Q               rotation of the second body relative to the first (3×3); ``turn`` is its rotation vector.
    spin            angular velocity of the second body relative to the first, rad/s.
    force, torque   on the second body at the second point, N and N·m; ``world`` holds both in the world frame.
    levers          from the origin of each body to the second point, world frame, m.
    potential       elastic energy, J.
    taken           power of the damping, W (≤ 0)."""

    offset: SX
    rate: SX
    Q: SX
    spin: SX
    force: SX
    torque: SX
    world: tuple[SX, SX]
    levers: tuple[SX, SX]
    potential: SX
    taken: SX

    @property
    def turn(self) -> SX:
        """Rotation vector of the second body relative to the first, rad."""
        w, *v = to_quaternion([[self.Q[r, c] for c in range(3)] for r in range(3)], ca)
        square = v[0] ** 2 + v[1] ** 2 + v[2] ** 2
        size = ca.sqrt(ca.fmax(square, SMALL))
        return ca.if_else(square < SMALL, 2, 2 * ca.atan2(size, w) / size) * ca.vertcat(*v)

    @property
    def power(self) -> SX:
        """Power of the bushing on the bodies, W."""
        return ca.dot(self.force, self.rate) + ca.dot(self.torque, self.spin)


def bushing(sym: Symbols, motions, load: Load) -> Bushing:
    """State of a bushing. motions: the motion of each body, by body index."""
    a, b = motions_of(motions, load.bodies)
    return bushing_state((a, b), sym.leaves(load.leaves))


def bushing_state(ends: tuple[Motion, Motion], numbers: SX) -> Bushing:
    """State of a bushing. ends: motions of the two bodies. numbers: parameters (``Load.leaves``), which are stiffness and damping
    (12), points (3 each) and frames (9 each, row-major)."""
    a, b = ends
    k, c, turning, slowing = (numbers[i : i + 3] for i in (0, 3, 6, 9))
    arm_a, arm_b = a.R @ numbers[12:15], b.R @ numbers[15:18]
    Ein, Eout = (m.R @ row_major(numbers[i : i + 9]) for m, i in ((a, 18), (b, 27)))
    (xa, _), (xb, vb) = point_motion(a, arm_a), point_motion(b, arm_b)
    to_b = ca.sparsify(arm_a + xb - xa)
    _, carried = point_motion(a, to_b)
    offset, rate = Ein.T @ (xb - xa), Ein.T @ (vb - carried)
    Q, spin = Ein.T @ Eout, Ein.T @ (b.omega - a.omega)
    force = -(k * offset + c * rate)
    torque = -(_gradient(Q, turning) + slowing * spin)
    potential = 0.5 * ca.dot(k * offset, offset) + 0.5 * ca.dot(turning, ca.vertcat(*[_square(Q, i) for i in range(3)]))
    taken = -ca.dot(c * rate, rate) - ca.dot(slowing * spin, spin)
    return Bushing(offset, rate, Q, spin, force, torque, (Ein @ force, Ein @ torque), (to_b, arm_b), potential, taken)


def wrenches_of(state: Bushing, load: Load) -> list[tuple[int, SX]]:
    """A pair (body, wrench) for each body of the bushing except the ground. The wrench (6×1) is at the body's reference origin."""
    force, torque = state.world
    return [
        (body, ca.sparsify(ca.vertcat(sign * force, sign * (torque + cross(lever, force)))))
        for body, lever, sign in zip(load.bodies, state.levers, (-1, 1), strict=True)
        if body != GROUND
    ]


def _square(Q: SX, i: int) -> SX:
    """4 v_i² from the diagonal of Q."""
    return 1 + 2 * Q[i, i] - Q[0, 0] - Q[1, 1] - Q[2, 2]


def _gradient(Q: SX, k: SX) -> SX:
    """The gradient 2 (w K v + v × K v), where w is the quaternion's scalar part. The code uses 4 w v_1 = Q_32 − Q_23 and 4 v_2 v_3
    = Q_32 + Q_23."""
    rows = []
    for i in range(3):
        j, n = (i + 1) % 3, (i + 2) % 3
        rows.append(0.5 * (k[i] * (Q[n, j] - Q[j, n]) + (k[n] - k[j]) * (Q[n, j] + Q[j, n])))
    return ca.vertcat(*rows)
