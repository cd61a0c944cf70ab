"""Vector algebra on symbols. Every result keeps structural zeros, which makes the generated code small."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

SX = ca.SX


def symbol(value) -> SX:
    """A number as an SX. If the number is an SX, the function returns it unchanged, because a copy takes ten times as long."""
    return value if isinstance(value, SX) else SX(value)


def vector(values: Sequence) -> SX:
    """Column of scalars with structural zeros where a value is exactly zero."""
    return ca.sparsify(ca.vertcat(*map(symbol, values)))


def matrix(rows: Sequence[Sequence]) -> SX:
    """Matrix of scalars with structural zeros."""
    return ca.sparsify(ca.vertcat(*[ca.horzcat(*map(symbol, row)) for row in rows]))


def row_major(values: SX) -> SX:
    """A matrix (3×3) from its 9 entries in row-major order."""
    return matrix([[values[3 * i + k] for k in range(3)] for i in range(3)])


def zeros(rows: int, columns: int = 1) -> SX:
    """A matrix of structural zeros, for which no code is generated."""
    return SX(rows, columns)


def skew(a: SX) -> SX:
    """The skew-symmetric matrix ã with ã b = a × b."""
    return matrix([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def cross(a: SX, b: SX) -> SX:
    """a × b for each column of b."""
    return ca.sparsify(ca.horzcat(*[ca.cross(a, column) for column in ca.horzsplit(b)]))


def Gamma(lever: SX, Z: SX) -> SX:
    """Γ Z (7): motion Z (6×columns) of a body's origin, moved to a point. lever: vector from the origin to the point."""
    return ca.sparsify(ca.vertcat(ca.sparsify(Z[:3, :] - cross(lever, Z[3:, :])), Z[3:, :]))


def GammaT(lever: SX, F: SX) -> SX:
    """Γᵀ F: wrenches F (6×columns) at a point, moved to the origin. lever: vector from the origin to the point."""
    return ca.sparsify(ca.vertcat(F[:3, :], F[3:, :] + cross(lever, F[:3, :])))


def symmetric(a: SX) -> SX:
    """The matrix with its upper triangle copied to the lower one, so that each entry is computed once."""
    out = SX(a)
    for i in range(a.size1()):
        for j in range(i):
            out[i, j] = out[j, i]
    return ca.sparsify(out)


def rotate_inertia(r: SX, j: Sequence) -> SX:
    """R J Rᵀ for J = (xx, yy, zz, xy, xz, yz). For a diagonal J, two dyads suffice."""
    xx, yy, zz, xy, xz, yz = (SX(v) for v in j)
    if all(v.is_zero() for v in (xy, xz, yz)):
        a, b = (xx - zz) * r[:, 0], (yy - zz) * r[:, 1]
        return symmetric(a @ r[:, 0].T + b @ r[:, 1].T + zz * SX.eye(3))
    return symmetric(r @ matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ r.T)


def solve_spd(d: SX, b: SX) -> SX:
    """d⁻¹ b by an unrolled LDLᵀ factorisation; d is the small symmetric positive definite matrix of a joint. d is nearly singular
    only if a freedom has no inertia, which ``trunnion check`` reports."""
    n = d.size1()
    low = SX.eye(n)
    diag: list[SX] = []
    for j in range(n):
        dj = d[j, j] - sum((low[j, k] ** 2 * diag[k] for k in range(j)), SX(0))
        diag.append(dj)
        for i in range(j + 1, n):
            low[i, j] = (d[i, j] - sum((low[i, k] * low[j, k] * diag[k] for k in range(j)), SX(0))) / dj
    x = [b[i, :] for i in range(n)]
    for i in range(n):
        for k in range(i):
            x[i] = x[i] - low[i, k] * x[k]
    x = [x[i] / diag[i] for i in range(n)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = x[i] - low[k, i] * x[k]
    return ca.sparsify(ca.vertcat(*x)) if n else zeros(0, b.size2())
