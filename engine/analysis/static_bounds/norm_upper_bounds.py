"""Upper bounds of norms, computed before any search (theory, "Bounds at rest").

Each vector is V⁰ + Σ B_i m_i, where V⁰ follows from the loads and m_i are the frictions. Each friction is at most a weighted sum
of norms. The norms ρ therefore satisfy ρ ≤ b + A ρ. If the spectral radius of A is below 1, then ρ ≤ (1 − A)⁻¹ b: friction cannot
be self-locking.
"""

from __future__ import annotations

import numpy as np

from trunnion.analysis.static_bounds.equilibrium_space import RANK
from trunnion.analysis.static_bounds.sum_of_norms_program import Program, Row

ROUNDS = 6
"""Largest number of rounds in which the weights of the friction equations are adapted to the bounds. Two or three rounds
suffice."""
CONTRACTS = 1.0 - 1e-12
"""The largest eigenvalue of A counts as below 1 if it is below this value. Larger values may differ from 1 by round-off only."""
ROOM = 1.0 + 1e-9
"""Bounds are multiplied by this factor. The excess over 1 is a thousand times the round-off of the bounds."""


Holds = list[dict[int, dict[int, float]]]
"""For each pair, {sense of friction: {term: weight}}: the weights of the terms in the capacity of the pair
(``holding_program``)."""


def norm_bounds(program: Program, sizes: list[int], holds: Holds, stress: dict[int, float]) -> tuple[Row, ...]:
    """Rows t_j ≤ ρ_j for the terms in capacities. The result is () if friction may be self-locking or if self-stress is unbounded.

    sizes, holds: as returned by ``holding_program``; stress: {term: largest change by self-stress}, empty if self-stress is
    unbounded.
    """
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
    """(|V⁰| of each term, largest change of each term per unit of each friction (terms × frictions)).

    weight: weight of the equation of each friction. The weights affect the result if there are more frictions than open
    directions.
    """
    D = np.repeat(weight, widths)[:, None]
    amounts = np.linalg.pinv(F[:, :-1] * D, rcond=RANK) * D.T
    first, last = np.cumsum([0, *widths[:-1]]), np.cumsum(widths)
    moved = [V[:, :-1] @ amounts for V in terms]
    b = np.array([np.linalg.norm(V[:, -1] - B @ F[:, -1]) for V, B in zip(terms, moved, strict=True)])
    C = np.array([[np.linalg.norm(B[:, i:k], 2) for i, k in zip(first, last, strict=True)] for B in moved])
    return b, C
