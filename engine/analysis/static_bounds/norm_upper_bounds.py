"""Upper bounds of norms before any search (theory, "Bounds at rest").

Each vector is V⁰, which the loads decide, plus B_i m_i for each friction m_i. Each friction is at most a sum of norms. The norms ρ
therefore obey ρ ≤ b + A ρ. Where A's spectral radius is below 1, they are at most (1 − A)⁻¹ b: no self-locking occurs.
"""

from __future__ import annotations

import numpy as np

from trunnion.analysis.static_bounds.equilibrium_space import RANK
from trunnion.analysis.static_bounds.norm_program import Program, Row

ROUNDS = 6
"""Most rounds in which the weights of the frictions' equations follow the bounds; two or three suffice."""
CONTRACTS = 1.0 - 1e-12
"""Largest eigenvalue of A that counts as below 1; nearer to 1 is round-off."""
ROOM = 1.0 + 1e-9
"""Factor on the bounds: a thousand times their round-off."""


Holds = list[dict[int, dict[int, float]]]
"""For each pair and sense of its friction: weights of terms in its capacity (``holding_program``)."""


def norm_bounds(program: Program, sizes: list[int], holds: Holds, stress: dict[int, float]) -> tuple[Row, ...]:
    """Rows t_j ≤ ρ_j of the terms in capacities; none where friction may lock itself, or self-stress has no bound.

    sizes, holds: of ``holding_program``; stress: for each term the largest change by self-stress, empty without a bound."""
    F = np.vstack([np.zeros((0, program.width)), *(program.terms[j] for j in sizes)])
    terms = sorted({k for made in holds for by in made.values() for k in by})
    if not terms or not (_determines_state(F[:, :-1]) or all(j in stress for j in terms)):
        return ()
    W = np.array([[max(by.get(k, 0.0) for by in made.values()) for k in terms] for made in holds])
    apart = np.array([stress.get(j, 0.0) for j in terms])
    widths = [len(program.terms[j]) for j in sizes]
    best, weight = np.full(len(terms), np.inf), np.ones(len(sizes))
    for _ in range(ROUNDS):
        b, C = _friction_response([program.terms[j] for j in terms], F, widths, weight)
        A = C @ W
        values, vectors = np.linalg.eig(A)
        if np.abs(values).max() < CONTRACTS:
            best = np.minimum(best, np.linalg.solve(np.eye(len(A)) - A, b + apart))
            most = W @ best
        else:
            most = W @ np.abs(vectors[:, int(np.argmax(np.abs(values)))])
        weight = 1.0 / np.maximum(most, RANK * max(float(most.max()), RANK))
    if not np.isfinite(best).all():
        return ()
    return tuple(Row(np.append(np.zeros(program.width - 1), -r * ROOM), {j: 1.0}) for j, r in zip(terms, best, strict=True))


def _determines_state(F: np.ndarray) -> bool:
    """Whether the frictions alone determine the state."""
    if not F.size:
        return F.shape[1] == 0
    sizes = np.linalg.svd(F, compute_uv=False)
    return len(sizes) >= F.shape[1] and bool(sizes[F.shape[1] - 1 :].min(initial=sizes[0]) > RANK * sizes[0])


def _friction_response(
    terms: list[np.ndarray], F: np.ndarray, widths: list[int], weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """(|V⁰| of each term; largest change of each term by a unit of each friction, terms × frictions).

    weight (frictions): weights of their equations, which decide the result where frictions outnumber the open directions."""
    D = np.repeat(weight, widths)[:, None]
    amounts = np.linalg.pinv(F[:, :-1] * D, rcond=RANK) * D.T
    first, last = np.cumsum([0, *widths[:-1]]), np.cumsum(widths)
    moved = [V[:, :-1] @ amounts for V in terms]
    b = np.array([np.linalg.norm(V[:, -1] - B @ F[:, -1]) for V, B in zip(terms, moved, strict=True)])
    C = np.array([[np.linalg.norm(B[:, i:k], 2) for i, k in zip(first, last, strict=True)] for B in moved])
    return b, C
