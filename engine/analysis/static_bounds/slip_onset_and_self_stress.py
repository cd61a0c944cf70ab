"""Two restrictions of the admissible states. At the onset of a motion, every pair that slides in the motion has friction at its
limit, directed against the motion. Self-stress is limited by a largest contact force."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from trunnion.analysis.static_bounds.elementary_motions import Motion
from trunnion.analysis.static_bounds.equilibrium_space import Space
from trunnion.analysis.static_bounds.sum_of_norms_program import Program, Row, term_index
from trunnion.elements.contact.static_friction_capacity import Pair


def restrict_to_onset(s: Space, program: Program, motion: Motion, sense: float) -> Program:
    """The program, restricted to states at which the motion can begin in this sense (±1).

    For a ball that does not rotate across its force, and for an unknown direction of sliding, the program contains further states.
    Its bounds are still valid.
    """
    terms: list[np.ndarray] = list(program.terms)
    rows, term = [], partial(term_index, terms)
    for i in motion.moving:
        if not motion.directed:
            rows += _friction_at_limit(s, s.pairs[i], term)
            continue
        pair, v = s.pairs[i], sense * motion.slides[i]
        d = v / float(np.linalg.norm(v))
        friction = s.friction(pair)
        if len(pair.eta) == 3:
            rows += _ball(s, pair, d, friction, term)
            continue
        held = {term(s.norm_vector(pair, n)): -n.weight for n in pair.against(d).norms}
        rows.append(Row(d @ friction, held, equal=True))
        rows += [Row(e @ friction, equal=True) for e in _perpendiculars(d)]
    return Program(tuple(terms), (*program.rows, *rows), program.objective, program.across, program.normal)


def _friction_at_limit(s: Space, pair: Pair, term: Callable[[np.ndarray], int]) -> list[Row]:
    """Rows for friction at its limit with unknown direction: the friction is at least the smallest capacity that the pair can
    have."""
    size, rows = term(s.friction(pair)), []
    for c in pair.capacities:
        held = {term(s.norm_vector(pair, n)): w for n, w in zip(c.norms, c.least or tuple(n.weight for n in c.norms), strict=True)}
        rows.append(Row(np.zeros(s.open + 1), {size: -1.0, **held}, when=(size, c.sense) if c.sense else None))
    return rows


def _ball(s: Space, pair: Pair, d: np.ndarray, friction: np.ndarray, term: Callable[[np.ndarray], int]) -> list[Row]:
    """Rows for a ball (theory, "Bounds at rest"): sinφ (|f × d| − μ |f·d|) ≤ m·d/r ≤ sinφ |f × d|. f: force; m: friction moment; r:
    radius; d: sliding direction.

    Adams' ball has μ = 0 here: its friction acts along the component of d perpendicular to the force.
    """
    held = pair.capacities[0].norms[0]
    force, weight = s.norm_vector(pair, held), held.weight
    mu = 0.0 if pair.across is None else pair.static
    aside, along = term(np.array(_perpendiculars(d)) @ force), term((d @ force)[None, :])
    return [Row(d @ friction, {aside: -weight}), Row(-d @ friction, {aside: weight, along: -weight * mu})]


def _perpendiculars(d: np.ndarray) -> list[np.ndarray]:
    """Unit vectors that complete d to an orthonormal frame."""
    return list(np.linalg.svd(d[None, :])[2][1:])


def _self_stress(s: Space) -> np.ndarray:
    """The projection of X ((d + 1) × (d + 1)) onto self-stress, that is, onto changes without friction, drive effort or free
    load."""
    own = s.basis[s.statics.eta0 :] * 1.0
    _, sizes, Vt = np.linalg.svd(own)
    rank = int((sizes > 1e-9 * max(float(np.abs(s.basis).max(initial=0.0)), 1e-300)).sum())
    free = Vt[rank:]
    project = np.zeros((s.open + 1, s.open + 1))
    project[:-1, :-1] = free.T @ free
    return project


Stress = float | Mapping[str, float]
"""Largest contact force by self-stress, N: one value for all joints, or {joint: value}."""


def limit_self_stress(s: Space, program: Program, most: Stress) -> tuple[Program, dict[int, float]]:
    """(the program in which self-stress is at most ``most`` at each contact, {term: the largest change of its norm by
    self-stress}).

    Self-stress is the part of the open directions without friction (theory, "Bounds at rest").
    """
    if not s.basis[s.statics.eta0 :].size:
        return program, {}
    project = _self_stress(s)
    terms, rows, kept = list(program.terms), [], []
    limits: list[float] = []
    for pair in s.pairs:
        limit = (most[pair.joint] if isinstance(most, Mapping) else most) / s.scale
        for n in pair.capacities[0].norms:
            V = n.contact * s.norm_vector(pair, n) @ project
            if np.abs(V).max(initial=0.0) > 1e-12:
                terms.append(V)
                kept.append(V)
                limits.append(limit)
                rows.append(Row(np.append(np.zeros(s.open), -limit), {len(terms) - 1: 1.0}))
    made = Program(tuple(terms), (*program.rows, *rows), program.objective, program.across, program.normal)
    return made, _largest_changes([V @ project for V in program.terms], kept, limits)


def _largest_changes(terms: list[np.ndarray], contacts: list[np.ndarray], most: list[float]) -> dict[int, float]:
    """The largest change of each term while the norm of each contact vector is at most its entry of ``most``. Terms that the
    contact vectors do not determine are omitted."""
    out = {}
    for j, V in enumerate(terms):
        own = next((k for k, C in enumerate(contacts) if len(C) == len(V) and _is_multiple(C, V)), None)
        if own is not None:
            out[j] = most[own] * float(np.linalg.norm(V) / np.linalg.norm(contacts[own]))
            continue
        every = np.vstack([np.zeros((0, V.shape[1])), *contacts])
        parts = np.linalg.lstsq(every.T, V.T, rcond=None)[0].T
        if np.abs(parts @ every - V).max(initial=0.0) <= 1e-9 * max(1.0, float(np.abs(V).max(initial=0.0))):
            blocks = np.split(parts, np.cumsum([len(C) for C in contacts])[:-1], axis=1) if contacts else []
            out[j] = sum(m * float(np.linalg.norm(B, 2)) for m, B in zip(most, blocks, strict=True))
    return out


def _is_multiple(C: np.ndarray, V: np.ndarray) -> bool:
    """Whether V is a multiple of C."""
    size = float(np.linalg.norm(C))
    return bool(np.abs(C * (np.linalg.norm(V) / size) - V).max() <= 1e-12 * max(1.0, float(np.abs(V).max())))
