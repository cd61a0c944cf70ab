"""States at which a motion can begin: every pair that slides in it has its friction at its limit, against the motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from engine.bounds.motions import Motion
from engine.bounds.program import Program, Row
from engine.bounds.space import Space
from engine.contact.resting import Pair


def beginning(s: Space, program: Program, motion: Motion, sense: float) -> Program:
    """The program's states at which the motion can begin in this sense (±1). Of a ball whose turning is not across its force,
    and where the direction of sliding is open, it is a superset, so that what no such state does is certain."""
    terms, rows = list(program.terms), []

    def term(V: np.ndarray) -> int:
        for j, other in enumerate(terms):
            if other.shape == V.shape and np.array_equal(other, V):
                return j
        terms.append(V)
        return len(terms) - 1

    for i in motion.moving:
        if not motion.directed:
            rows += _full(s, s.pairs[i], term)
            continue
        pair, v = s.pairs[i], sense * motion.slides[i]
        d = v / float(np.linalg.norm(v))
        friction = s.friction(pair)
        if len(pair.eta) == 3:
            rows += _ball(s, pair, d, friction, term)
            continue
        held = {term(s.of_norm(pair, n)): -n.weight for n in pair.against(d).norms}
        rows.append(Row(d @ friction, held, equal=True))
        rows += [Row(e @ friction, equal=True) for e in _others(d)]
    return Program(tuple(terms), (*program.rows, *rows), program.objective, program.across, program.normal)


def _full(s: Space, pair: Pair, term: Callable[[np.ndarray], int]) -> list[Row]:
    """Friction of no known direction is at its limit: no less than what the pair holds at least."""
    size, rows = term(s.friction(pair)), []
    for c in pair.capacities:
        held = {term(s.of_norm(pair, n)): w for n, w in zip(c.norms, c.least or tuple(n.weight for n in c.norms), strict=True)}
        rows.append(Row(np.zeros(s.open + 1), {size: -1.0, **held}, when=(size, c.sense) if c.sense else None))
    return rows


def _ball(s: Space, pair: Pair, d: np.ndarray, friction: np.ndarray, term: Callable[[np.ndarray], int]) -> list[Row]:
    """sinφ (|f × d| − μ |f·d|) ≤ m·d/r ≤ sinφ |f × d| (METHOD, "Bounds at rest"); Adams' ball has its friction along the part of d
    across the force, and no such cone."""
    held = pair.capacities[0].norms[0]
    force, weight = s.of_norm(pair, held), held.weight
    mu = 0.0 if pair.across is None else pair.static
    aside, along = term(np.array(_others(d)) @ force), term((d @ force)[None, :])
    return [Row(d @ friction, {aside: -weight}), Row(-d @ friction, {aside: weight, along: -weight * mu})]


def _others(d: np.ndarray) -> list[np.ndarray]:
    """Unit vectors that with d make a right-angled frame."""
    return list(np.linalg.svd(d[None, :])[2][1:])


def _self_stress(s: Space) -> np.ndarray:
    """The part of X that is self-stress: that in which no friction, drive or asked load takes part."""
    own = s.basis[s.statics.eta0 :] * 1.0
    _, sizes, Vt = np.linalg.svd(own)
    rank = int((sizes > 1e-9 * max(float(np.abs(s.basis).max(initial=0.0)), 1e-300)).sum())
    free = Vt[rank:]
    project = np.zeros((s.open + 1, s.open + 1))
    project[:-1, :-1] = free.T @ free
    return project


Stress = float | Mapping[str, float]
"""The most that self-stress loads a contact with, N: of all joints, or of each by its name."""


def stressed(s: Space, program: Program, most: Stress) -> tuple[Program, dict[int, float]]:
    """(the program's states whose self-stress loads no contact by more than ``most``; by how much it can change each term at
    most). Self-stress is the part of the open amounts in which no friction takes part (METHOD, "Bounds at rest")."""
    if not s.basis[s.statics.eta0 :].size:
        return program, {}
    project = _self_stress(s)
    terms, rows, kept = list(program.terms), [], []
    limits: list[float] = []
    for pair in s.pairs:
        limit = (most[pair.joint] if isinstance(most, Mapping) else most) / s.scale
        for n in pair.capacities[0].norms:
            V = n.contact * s.of_norm(pair, n) @ project
            if np.abs(V).max(initial=0.0) > 1e-12:
                terms.append(V)
                kept.append(V)
                limits.append(limit)
                rows.append(Row(np.append(np.zeros(s.open), -limit), {len(terms) - 1: 1.0}))
    made = Program(tuple(terms), (*program.rows, *rows), program.objective, program.across, program.normal)
    return made, _changes([V @ project for V in program.terms], kept, limits)


def _changes(terms: list[np.ndarray], contacts: list[np.ndarray], most: list[float]) -> dict[int, float]:
    """The most that each term changes by while no vector of contacts is longer than its ``most``; those that contacts do not decide
    are left out."""
    out = {}
    for j, V in enumerate(terms):
        own = next((k for k, C in enumerate(contacts) if len(C) == len(V) and _along(C, V)), None)
        if own is not None:
            out[j] = most[own] * float(np.linalg.norm(V) / np.linalg.norm(contacts[own]))
            continue
        every = np.vstack([np.zeros((0, V.shape[1])), *contacts])
        parts = np.linalg.lstsq(every.T, V.T, rcond=None)[0].T
        if np.abs(parts @ every - V).max(initial=0.0) <= 1e-9 * max(1.0, float(np.abs(V).max(initial=0.0))):
            blocks = np.split(parts, np.cumsum([len(C) for C in contacts])[:-1], axis=1) if contacts else []
            out[j] = sum(m * float(np.linalg.norm(B, 2)) for m, B in zip(most, blocks, strict=True))
    return out


def _along(C: np.ndarray, V: np.ndarray) -> bool:
    """Whether V is a multiple of C."""
    size = float(np.linalg.norm(C))
    return bool(np.abs(C * (np.linalg.norm(V) / size) - V).max() <= 1e-12 * max(1.0, float(np.abs(V).max())))
