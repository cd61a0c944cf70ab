"""Articulated inertias with friction: a Newton step on η − law(N(η)) is one more pass over the bodies (theory, "Friction along the
recursion").

A friction law depends only on the reaction of its own joint. Let K = ∂law/∂N ∂N/∂(reaction) be the derivative of the law, and e the
remainder of its linearisation. The balance along the joint's freedoms is then (Πᵀ + K) N = Q − e. The reduction (27)–(42) projects
with Πᵀ + K instead of Πᵀ, and articulated inertias become unsymmetric. A freedom held at rest has a zero column in Π; the joint
then transmits the friction of this freedom."""

from __future__ import annotations

import casadi as ca

from trunnion.kernel.c_code.code_generator import Input, Output
from trunnion.recursion.body_kinematics import Step
from trunnion.recursion.masses_and_forces import Mass
from trunnion.recursion.vector_algebra import SX, Gamma, GammaT, skew, zeros

NARROW = ("turned", "borne", "grip", "moves", "pivot", "slim")
"""Names of operands. turned: sum of the inertias from outboard bodies (6×6, column-major). borne: operand ``turned`` of the inboard
body, to which the body adds its inertia. grip: K of the free freedoms (n×6). moves: for each free freedom, 1 if it moves, 0 if it
is at rest. pivot: determinant of the joint's block. slim: stored values."""
Functions = tuple[list[Input], list[Output]]


def narrowed(
    mass: Mass, step: Step, steady: SX, at: dict[str, str], stage: int, looped: bool, spun: SX,
) -> list[Functions]:  # fmt: skip
    """Inputs and outputs of the stages from ``stage`` on: ``narrow`` (inertias and pivots), ``pull`` (forces inward), ``push``
    (accelerations and reactions outward). looped: whether to add ``press``, ``sense`` and ``swing``.

    steady: F⁰ of the body (17 in the paper). spun: rotor inertias of the free freedoms (n×n)."""
    n = step.Pi.size2()
    turned, grip, moves = SX.sym("turned", 36), SX.sym("grip", n, 6), SX.sym("moves", n)
    own = ca.vertcat(ca.horzcat(mass.M11, mass.M12), ca.horzcat(mass.M12.T, mass.M22))
    M = ca.sparsify(own) + ca.reshape(turned, 6, 6)
    free, held = ca.diag(moves), ca.diag(1 - moves)
    Pi, rows = ca.sparsify(step.Pi @ free), ca.sparsify(free @ (step.Pi.T + grip))
    MPi, LM = M @ Pi, rows @ M
    inverse, pivot = _inverse(rows @ MPi + free @ spun + held)
    V = inverse @ LM
    lever = ca.vertcat(ca.horzcat(SX.eye(3), -skew(step.lever)), ca.horzcat(zeros(3, 3), SX.eye(3)))
    borne = ca.sparsify(lever).T @ (M - MPi @ V) @ ca.sparsify(lever)
    ins = [Input(at["turned"], turned, stage, transient=True), Input(at["grip"], ca.vec(grip), stage, transient=True),
           Input(at["moves"], moves, stage, transient=True)]  # fmt: skip
    outs = [Output(at["borne"], 0, ca.vec(borne), stage, True, True), Output(at["pivot"], 0, pivot, stage)]
    inward = _pull(M @ step.w, MPi, step, steady, (rows, inverse, moves), at, stage + 1)
    found = [(ins, outs), inward, _push(M, step, Pi, V, spun, at, stage + 2)]
    return [*found, *(_of_loops(step, Pi, MPi, inverse @ rows, V, at, stage + 3) if looped else [])]


def _pull(Mw: SX, MPi: SX, step: Step, steady: SX, projected: tuple[SX, SX, SX], at: dict[str, str], stage: int) -> Functions:
    """The inward step of the forces. Inputs: the wrench from outboard bodies (``fc``), the wrench on the body, and the forces along
    the free freedoms, from which e is subtracted (``yc``). Outputs: y, the total wrench F̄ on the body, and the wrench on the
    inboard body."""
    rows, inverse, moves = projected
    handed, force, along = SX.sym("handed", 6), SX.sym("force", 6), SX.sym("along", step.Pi.size2())
    F = steady + force + handed
    y = inverse @ (rows @ (F - Mw) + moves * along)
    up = GammaT(step.lever, F - Mw - MPi @ y)
    ins = [Input(at["fc"], handed, stage), Input(at["force"], force, stage), Input(at["yc"], along, stage)]
    return ins, [Output(at["y"], 0, y, stage), Output(at["F"], 0, F, stage), Output(at["up"], 0, up, stage, True, True)]


def _push(M: SX, step: Step, Pi: SX, V: SX, spun: SX, at: dict[str, str], stage: int) -> Functions:
    """The outward step of the accelerations. Inputs: Ż of the inboard body, y, F̄. Outputs: q̈, Ż, the joint's reaction N, and the
    sum of Πᵀ N and rotor forces."""
    Z, y, F = SX.sym("Z", 6), SX.sym("y", step.Pi.size2()), SX.sym("F", 6)
    carried = Gamma(step.lever, Z)
    qdd = y - V @ carried
    moved = carried + Pi @ qdd + step.w
    N = M @ moved - F
    ins = [Input(at["Z"], Z, stage), Input(at["yc"], y, stage), Input(at["fc"], F, stage)]
    along = step.Pi.T @ N + spun @ qdd
    return ins, [Output(at[name], 0, v, stage) for name, v in (("qdd", qdd), ("Zo", moved), ("N", N), ("fq", along))]


def _of_loops(step: Step, Pi: SX, MPi: SX, answer: SX, V: SX, at: dict[str, str], stage: int) -> list[Functions]:
    """Functions for loops. ``press`` reduces a force column f inward, to y = P⁻¹ (Πᵀ + K) f and the column on the inboard body.
    ``sense`` reduces a row r of the constraint equations inward, to r Π and the row on the inboard body. ``press`` and ``sense``
    are transposes of each other only without friction. ``swing`` computes outward the accelerations that force columns cause."""
    f, r, Z, y = SX.sym("f", 6), SX.sym("r", 6), SX.sym("Zc", 6), SX.sym("ys", step.Pi.size2())
    pressed, along, carried = answer @ f, Pi.T @ r, Gamma(step.lever, Z)
    qdd = y - V @ carried
    press = [("yc", pressed, False), ("up", GammaT(step.lever, f - MPi @ pressed), True)]
    sense = [("fq", along, False), ("up", GammaT(step.lever, r - V.T @ along), True)]
    swing = [("qdd", qdd, False), ("Zo", carried + Pi @ qdd, False)]
    out = []
    for k, (ins, outs) in enumerate(((((("fc", f),)), press), ((("fc", r),), sense), ((("Z", Z), ("yc", y)), swing))):
        out.append(([Input(at[n], v, stage + k) for n, v in ins], [Output(at[n], 0, v, stage + k, add) for n, v, add in outs]))
    return out


def _inverse(P: SX) -> tuple[SX, SX]:
    """Inverse and determinant of a joint's unsymmetric block. For up to three freedoms, cofactors give the inverse; for more,
    elimination without pivoting. A joint with friction has at most three freedoms."""
    n = P.size1()
    if n == 0:
        return zeros(0, 0), SX(1)
    if n <= 3:
        det = ca.det(P)
        return ca.adj(P) / det, det
    low, det = SX(P), SX(1)
    right = SX.eye(n)
    for k in range(n):
        det = det * low[k, k]
        scaled, moved = low[k, :] / low[k, k], right[k, :] / low[k, k]
        for i in range(n):
            factor = low[i, k]
            low[i, :] = scaled if i == k else low[i, :] - factor * scaled
            right[i, :] = moved if i == k else right[i, :] - factor * moved
    return right, det
