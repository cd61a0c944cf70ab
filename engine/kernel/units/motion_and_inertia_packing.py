"""Motions, and the inertias that bodies pass inward, as lists of scalars for the operands of bytecode primitives."""

from __future__ import annotations

import casadi as ca

from trunnion.recursion.body_kinematics import Motion
from trunnion.recursion.vector_algebra import SX, symmetric, zeros

UPPER = [(i, j) for i in range(3) for j in range(i, 3)]
"""Stored entries of a symmetric matrix (3×3)."""


def pack_motion(m: Motion) -> list[SX]:
    """A motion as the 18 scalars of ``MOTION``."""
    return [m.R[i, j] for j in range(3) for i in range(3)] + [v[i] for v in (m.r, m.omega, m.rdot) for i in range(3)]


def unpack_motion(v: list[SX]) -> Motion:
    """A motion from the 18 scalars of ``MOTION``."""
    R = ca.sparsify(ca.horzcat(*[ca.vertcat(*v[3 * j : 3 * j + 3]) for j in range(3)]))
    r, omega, rdot = (ca.sparsify(ca.vertcat(*v[k : k + 3])) for k in (9, 12, 15))
    return Motion(R, r, omega, rdot)


def pack_handed(M11: SX, M12: SX, M22: SX, F: SX) -> list[SX]:
    """ΔM (its blocks) and ΔF as the 27 scalars of ``HANDED``."""
    square = [M12[i, j] for j in range(3) for i in range(3)]
    return [M11[i, j] for i, j in UPPER] + square + [M22[i, j] for i, j in UPPER] + [F[i] for i in range(6)]


def unpack_handed(v: list[SX]) -> tuple[SX, SX, SX, SX]:
    """The three blocks of ΔM, and ΔF, from the 27 scalars of ``HANDED``."""

    def upper(values: list[SX]) -> SX:
        out = zeros(3, 3)
        for (i, j), x in zip(UPPER, values, strict=True):
            out[i, j] = x
        return symmetric(ca.sparsify(out))

    M12 = ca.sparsify(ca.horzcat(*[ca.vertcat(*v[6 + 3 * j : 9 + 3 * j]) for j in range(3)]))
    return upper(v[:6]), M12, upper(v[15:21]), ca.sparsify(ca.vertcat(*v[21:27]))
