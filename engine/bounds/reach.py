"""How large norms can be, before any search: friction is a small part of what presses, and moves that by a small part again.

What loads decide is V⁰; each friction m_i adds B_i m_i, and is itself at most a sum of norms. So norms ρ obey ρ ≤ b + A ρ, and
where A's spectral radius is below 1 they are at most (1 − A)⁻¹ b: nothing locks itself (METHOD, "Bounds at rest").
"""

from __future__ import annotations

import numpy as np

from engine.bounds.program import Program, Row
from engine.bounds.space import RANK

ROUNDS = 6
"""Which equations frictions are told apart by is chosen anew with what they turn out to be at most; it settles in two or three."""
CONTRACTS = 1.0 - 1e-12
"""Largest eigenvalue up to which what frictions do to each other comes to an end: nearer to 1 there is only round-off."""
ROOM = 1.0 + 1e-9
"""Round-off of the bounds, a thousand times."""


Holds = list[dict[int, dict[int, float]]]
"""By pair, and by sense of its friction: what it holds, as weights of terms (``holding``)."""


def reached(program: Program, sizes: list[int], holds: Holds, stress: dict[int, float]) -> tuple[Row, ...]:
    """Rows t_j ≤ ρ_j of the terms in what pairs hold; none where friction may lock, or self-stress has no bound. sizes, holds: of
    ``holding``; stress: by term the most that self-stress changes it by (empty: it has no bound)."""
    F = np.vstack([np.zeros((0, program.width)), *(program.terms[j] for j in sizes)])
    terms = sorted({k for made in holds for by in made.values() for k in by})
    if not terms or not (_fixes(F[:, :-1]) or all(j in stress for j in terms)):
        return ()
    W = np.array([[max(by.get(k, 0.0) for by in made.values()) for k in terms] for made in holds])
    apart = np.array([stress.get(j, 0.0) for j in terms])
    widths = [len(program.terms[j]) for j in sizes]
    best, weight = np.full(len(terms), np.inf), np.ones(len(sizes))
    for _ in range(ROUNDS):
        b, C = _response([program.terms[j] for j in terms], F, widths, weight)
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


def _fixes(F: np.ndarray) -> bool:
    """Whether frictions alone say which state it is."""
    if not F.size:
        return F.shape[1] == 0
    sizes = np.linalg.svd(F, compute_uv=False)
    return len(sizes) >= F.shape[1] and bool(sizes[F.shape[1] - 1 :].min(initial=sizes[0]) > RANK * sizes[0])


def _response(terms: list[np.ndarray], F: np.ndarray, widths: list[int], weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(|V⁰| of each term, by each friction the most a unit of it moves each term by). Where frictions are more than open directions
    their equations are weighed, which changes what is attributed to which."""
    D = np.repeat(weight, widths)[:, None]
    amounts = np.linalg.pinv(F[:, :-1] * D, rcond=RANK) * D.T
    first, last = np.cumsum([0, *widths[:-1]]), np.cumsum(widths)
    moved = [V[:, :-1] @ amounts for V in terms]
    b = np.array([np.linalg.norm(V[:, -1] - B @ F[:, -1]) for V, B in zip(terms, moved, strict=True)])
    C = np.array([[np.linalg.norm(B[:, i:k], 2) for i, k in zip(first, last, strict=True)] for B in moved])
    return b, C
