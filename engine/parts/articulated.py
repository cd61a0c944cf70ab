"""Friction along the recursion: a Newton step on η − law(N(η)) as one more pass of the bodies (METHOD, of that name).

A law is local to its joint. With its derivative K = ∂law/∂N ∂N/∂(reaction), rows beside Πᵀ, the balance along the freedoms of a
joint reads (Πᵀ + K) N = Q − e: the reduction of (27)–(42) with Πᵀ + K in the place of Πᵀ where it projects. Articulated inertias
become unsymmetric. A freedom that is held at rest is left out of Π: what friction it needs is what the joint then transmits along
it."""

from __future__ import annotations

import casadi as ca

from engine.kernel.emit import Input, Output
from engine.recursion.kinematics import Step
from engine.recursion.loads import Mass
from engine.recursion.vectors import SX, Gamma, GammaT, skew, zeros

NARROW = ("turned", "borne", "grip", "moves", "pivot", "slim")
"""Places: inertia that bodies carried hand over (6×6, column-major) and where their sum goes on the inboard one, K of the free
freedoms (n×6), 1 for each that moves and 0 for each that is held, determinant of the joint's own block, what is kept."""
Functions = tuple[list[Input], list[Output]]


def narrowed(
    mass: Mass, step: Step, steady: SX, at: dict[str, str], stage: int, looped: bool, spun: SX,
) -> list[Functions]:  # fmt: skip
    """Inputs and outputs of ``narrow`` (inertias and pivots, from K and what moves), ``pull`` (forces inward) and ``push``
    (accelerations and reactions outward), which are stages from ``stage`` on; looped: and of those for loops' multipliers.
    steady: F⁰ of the body (17); spun: rotor inertias of the free freedoms (n×n)."""
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
    outs = [Output(at["borne"], 0, ca.vec(borne), stage, True), Output(at["pivot"], 0, pivot, stage)]
    inward = _pull(M @ step.w, MPi, step, steady, (rows, inverse, moves), at, stage + 1)
    found = [(ins, outs), inward, _push(M, step, Pi, V, spun, at, stage + 2)]
    return [*found, *(_of_loops(step, Pi, MPi, inverse @ rows, V, at, stage + 3) if looped else [])]


def _pull(Mw: SX, MPi: SX, step: Step, steady: SX, projected: tuple[SX, SX, SX], at: dict[str, str], stage: int) -> Functions:
    """Forces inward: what bodies carried hand over (in ``fc``), what acts on the body, the force along the free freedoms (in
    ``yc``: devices less e) → y, all forces F̄ on the body, and what it hands over."""
    rows, inverse, moves = projected
    handed, force, along = SX.sym("handed", 6), SX.sym("force", 6), SX.sym("along", step.Pi.size2())
    F = steady + force + handed
    y = inverse @ (rows @ (F - Mw) + moves * along)
    up = GammaT(step.lever, F - Mw - MPi @ y)
    ins = [Input(at["fc"], handed, stage), Input(at["force"], force, stage), Input(at["yc"], along, stage)]
    return ins, [Output(at["y"], 0, y, stage), Output(at["F"], 0, F, stage), Output(at["up"], 0, up, stage, True)]


def _push(M: SX, step: Step, Pi: SX, V: SX, spun: SX, at: dict[str, str], stage: int) -> Functions:
    """Accelerations outward: Ż of the inboard body, y and F̄ → q̈, Ż, the reaction N of its joint and Πᵀ N with what rotors take."""
    Z, y, F = SX.sym("Z", 6), SX.sym("y", step.Pi.size2()), SX.sym("F", 6)
    carried = Gamma(step.lever, Z)
    qdd = y - V @ carried
    moved = carried + Pi @ qdd + step.w
    N = M @ moved - F
    ins = [Input(at["Z"], Z, stage), Input(at["yc"], y, stage), Input(at["fc"], F, stage)]
    along = step.Pi.T @ N + spun @ qdd
    return ins, [Output(at[name], 0, v, stage) for name, v in (("qdd", qdd), ("Zo", moved), ("N", N), ("fq", along))]


def _of_loops(step: Step, Pi: SX, MPi: SX, answer: SX, V: SX, at: dict[str, str], stage: int) -> list[Functions]:
    """``press``: a force column f inward → y = P⁻¹ (Πᵀ + K) f, and what it hands over. ``sense``: a row r of constraint equations
    inward → r Π, and what it asks of the inboard body's acceleration. They are each other's transpose only where nothing rubs.
    ``swing``: accelerations outward that are caused by such columns alone."""
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
    """Inverse and determinant of a joint's block, which is not symmetric: by cofactors, or for more than three freedoms by
    elimination in their order (no joint with friction has so many; what it carries may rub)."""
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
