"""Bushings: stiffness and damping in all six directions between two bodies, in axes of the first (METHOD, "Bushings").

With E the first body's axes there, δ = Eᵀ(x_b − x_a) and Q = Eᵀ E_b: the force on the second body is −(K δ + C δ̇), and its torque
the gradient of Σ 2 k_i v_i², v being the vector part of Q's quaternion. Its products with the scalar part are entries of Q, so
that nothing divides and no sign has to be chosen.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from engine.joints.base import to_quaternion
from engine.recursion.kinematics import GROUND_MOTION, Motion, axes_of, point_motion
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX, cross
from engine.system.structure import GROUND, Load

SMALL = 1e-20
"""Square of a quaternion's vector part below which its angle is twice its length to the last digit."""


@dataclass
class Bushing:
    """What a bushing does at an instant, in its axes on the first body unless said otherwise. offset, its rate: of the second
    point from the first, m; turn: rotation vector of the second body, rad; spin: its angular velocity relative to the first;
    force, torque: on the second body at its point; world: the same two there; levers: from the bodies' origins to the second
    point; potential, J; taken: power of its damping, W (≤ 0)."""

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
        """Rotation vector of the second body, rad."""
        w, *v = to_quaternion([[self.Q[r, c] for c in range(3)] for r in range(3)], ca)
        square = v[0] ** 2 + v[1] ** 2 + v[2] ** 2
        size = ca.sqrt(ca.fmax(square, SMALL))
        return ca.if_else(square < SMALL, 2, 2 * ca.atan2(size, w) / size) * ca.vertcat(*v)

    @property
    def power(self) -> SX:
        """Power of the bushing on the bodies, W."""
        return ca.dot(self.force, self.rate) + ca.dot(self.torque, self.spin)


def bushing(sym: Symbols, motions, load: Load) -> Bushing:
    """The state of a bushing; motions: of the bodies by their number."""
    a, b = (_motion(motions, body) for body in load.bodies)
    k, c, turning, slowing = (sym.leaves(load.numbers[i : i + 3]) for i in (0, 3, 6, 9))
    (arm_a, arm_b), (Ein, Eout) = (
        [m.R @ sym.leaves(p) for m, p in zip((a, b), load.points, strict=True)],
        [m.R @ axes_of(sym, frame) for m, frame in zip((a, b), load.frames, strict=True)],
    )
    (xa, _), (xb, vb) = (point_motion(motions, body, arm) for body, arm in zip(load.bodies, (arm_a, arm_b), strict=True))
    to_b = ca.sparsify(arm_a + xb - xa)
    _, carried = point_motion(motions, load.bodies[0], to_b)
    offset, rate = Ein.T @ (xb - xa), Ein.T @ (vb - carried)
    Q, spin = Ein.T @ Eout, Ein.T @ (b.omega - a.omega)
    force = -(k * offset + c * rate)
    torque = -(_gradient(Q, turning) + slowing * spin)
    potential = 0.5 * ca.dot(k * offset, offset) + 0.5 * ca.dot(turning, ca.vertcat(*[_square(Q, i) for i in range(3)]))
    taken = -ca.dot(c * rate, rate) - ca.dot(slowing * spin, spin)
    return Bushing(offset, rate, Q, spin, force, torque, (Ein @ force, Ein @ torque), (to_b, arm_b), potential, taken)


def wrenches_of(state: Bushing, load: Load) -> list[tuple[int, SX]]:
    """What it does to its bodies at their reference origins (6×1 each). The ground is left out."""
    force, torque = state.world
    return [
        (body, ca.sparsify(ca.vertcat(sign * force, sign * (torque + cross(lever, force)))))
        for body, lever, sign in zip(load.bodies, state.levers, (-1, 1), strict=True)
        if body != GROUND
    ]


def _motion(motions, body: int) -> Motion:
    return GROUND_MOTION if body == GROUND else motions[body]


def _square(Q: SX, i: int) -> SX:
    """4 v_i² of a rotation."""
    return 1 + 2 * Q[i, i] - Q[0, 0] - Q[1, 1] - Q[2, 2]


def _gradient(Q: SX, k: SX) -> SX:
    """2 (w K v + v × K v), by 4 w v_1 = Q_32 − Q_23 and 4 v_2 v_3 = Q_32 + Q_23."""
    rows = []
    for i in range(3):
        j, n = (i + 1) % 3, (i + 2) % 3
        rows.append(0.5 * (k[i] * (Q[n, j] - Q[j, n]) + (k[n] - k[j]) * (Q[n, j] + Q[j, n])))
    return ca.vertcat(*rows)
