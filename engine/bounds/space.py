"""All states in equilibrium as an affine space, and what is asked of them as a program of norms.

A state is x = x₀ + B y with y the amounts of the open directions, N: B spans what balances itself and moves a contact force, a
friction or an asked load, and is scaled so that unit y are unit contact forces. Everything is divided by a force scale of the
loads.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.bounds.program import Across, Program, Row
from engine.bounds.statics import Statics
from engine.contact.resting import Norm, Pair

RANK = 1e-9
"""Directions of equilibrium below this part of the largest are none: round-off is 1e-14, a mechanism's own numbers 1e-6."""


@dataclass(frozen=True)
class Space:
    """States in equilibrium. origin x₀ (n), basis B (n × d); load: index of the load whose amount is the last entry of x, or None;
    scale: N; misses: by how much equilibrium fails everywhere, of the loads (a freedom that nothing holds)."""

    statics: Statics
    pairs: tuple[Pair, ...]
    origin: np.ndarray
    basis: np.ndarray
    load: int | None
    scale: float
    misses: float

    @property
    def open(self) -> int:
        """How many open directions there are."""
        return self.basis.shape[1]

    def x(self, X: np.ndarray) -> np.ndarray:
        """The state at X = [y; 1], of the scale."""
        return self.scale * (self.basis @ X[:-1] + self.origin * X[-1])

    def reactions(self, x: np.ndarray) -> np.ndarray:
        """Reaction components of a state (nn)."""
        rows, constant = _reaction_map(self.statics, self.load)
        return rows @ x + constant

    def functional(self, rows: np.ndarray, constant: np.ndarray) -> np.ndarray:
        """Linear functions rows · x + constant of a state as rows over X."""
        return np.column_stack([rows @ self.basis, rows @ self.origin + constant / self.scale])

    def of_norm(self, pair: Pair, n: Norm) -> np.ndarray:
        """The vector of a norm over X."""
        rows, constant = _contact(self.statics, self.load, pair, n.rows)
        return self.functional(rows, constant + n.added)

    def friction(self, pair: Pair) -> np.ndarray:
        """Friction of a pair at the surface over X."""
        rows = np.zeros((len(pair.eta), len(self.origin)))
        for k, eta in enumerate(pair.eta):
            rows[:, self.statics.eta0 + eta] = pair.friction[:, k]
        return self.functional(rows, np.zeros(len(rows)))

    def amount(self, index: int) -> np.ndarray:
        """An entry of x over X."""
        row = np.zeros((1, len(self.origin)))
        row[0, index] = 1.0
        return self.functional(row, np.zeros(1))[0]


def space(st: Statics, pairs: tuple[Pair, ...], load: int | None = None) -> Space:
    """States in equilibrium with all loads as they are, but for the one named."""
    E = st.balance if load is None else np.column_stack([st.balance, st.by_load[:, load]])
    now = st.now.copy()
    if load is not None:
        now[load] = 0.0
    e = st.constant + st.by_load @ now
    smooth = [st.eta0 + k for j in st.joints if not j.element.sets for k in j.rubs.eta]  # at rest their friction is none
    E, e = np.vstack([E, np.eye(E.shape[1])[smooth]]), np.append(e, np.zeros(len(smooth)))
    origin, null, misses = _solutions(E, e, st.force)
    looks = _looks(st, pairs, load)
    seen = looks[:, :-1] @ null
    U, sizes, Vt = np.linalg.svd(seen, full_matrices=False) if seen.size else (seen, np.zeros(0), np.zeros((0, null.shape[1])))
    keep = sizes > RANK * max(sizes.max(initial=0.0), 1e-300)
    basis = null @ (Vt[keep].T / sizes[keep])
    at = looks[:, :-1] @ origin + looks[:, -1]
    origin = origin - basis @ (U[:, keep].T @ at)
    size = float(np.abs(looks[:, :-1] @ origin + looks[:, -1]).max(initial=0.0))
    scale = size if size > 1e-9 * st.force else st.force
    return Space(st, pairs, origin / scale, basis, load, scale, misses)


def _solutions(E: np.ndarray, e: np.ndarray, force: float) -> tuple[np.ndarray, np.ndarray, float]:
    """(one x with E x + e = 0, a basis of the null space, what is left of the equations)."""
    n = E.shape[1]
    if not len(E):
        return np.zeros(n), np.eye(n), 0.0
    row = np.maximum(np.abs(E).max(axis=1, initial=0.0), 1e-300)
    column = np.maximum((np.abs(E) / row[:, None]).max(axis=0, initial=0.0), 1e-300)
    column[column <= 1e-12] = 1.0
    S = E / row[:, None] / column
    U, sizes, Vt = np.linalg.svd(S)
    rank = int((sizes > RANK * sizes.max(initial=0.0)).sum())
    right = -e / row
    x = Vt[:rank].T @ ((U[:, :rank].T @ right) / sizes[:rank]) / column
    left = np.abs(E @ x + e).max(initial=0.0)
    return x, (Vt[rank:] / column).T, float(left) / max(float(np.abs(e).max()), 1e-12 * force)


def _reaction_map(st: Statics, load: int | None) -> tuple[np.ndarray, np.ndarray]:
    now = st.now.copy()
    if load is None:
        return st.reaction, st.reaction_constant + st.reaction_by_load @ now
    now[load] = 0.0
    return np.column_stack([st.reaction, st.reaction_by_load[:, load]]), st.reaction_constant + st.reaction_by_load @ now


def _contact(st: Statics, load: int | None, pair: Pair, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows over a joint's own components as rows over x."""
    R, constant = _reaction_map(st, load)
    mine = st.joint(pair.joint).reactions
    return rows @ R[mine], rows @ constant[mine]


def _looks(st: Statics, pairs: tuple[Pair, ...], load: int | None) -> np.ndarray:
    """All that is looked at, in N, as rows over [x; 1]: contact forces, frictions, and efforts that are asked for."""
    n = st.balance.shape[1] + (load is not None)
    out: list[np.ndarray] = [np.zeros((0, n + 1))]
    for pair in pairs:
        for c in pair.capacities:
            for norm in c.norms:
                rows, constant = _contact(st, load, pair, norm.rows)
                out.append(np.column_stack([rows, constant + norm.added]))
        rows = np.zeros((len(pair.eta), n + 1))
        for k, eta in enumerate(pair.eta):
            rows[:, st.eta0 + eta] = pair.friction[:, k]
        out.append(rows)
    for k, effort in enumerate([*st.drives, *([] if load is None else [st.loads[load]])]):
        row = np.zeros((1, n + 1))
        row[0, st.multipliers + k] = 1.0 if effort.unit == "N" else 1.0 / st.length
        out.append(row)
    return np.vstack(out)


def holding(s: Space) -> tuple[Program, list[int], list[dict[int, dict[int, float]]]]:
    """(program of all admissible states, for every pair the term of its friction, and by sense what its capacity is made of)."""
    terms: list[np.ndarray] = []
    rows: list[Row] = []
    across: list[Across] = []
    sizes: list[int] = []
    holds: list[dict[int, dict[int, float]]] = []
    none = np.zeros(s.open + 1)

    def term(V: np.ndarray) -> int:
        for j, other in enumerate(terms):
            if other.shape == V.shape and np.array_equal(other, V):
                return j
        terms.append(V)
        return len(terms) - 1

    for pair in s.pairs:
        size = term(s.friction(pair))
        sizes.append(size)
        made: dict[int, dict[int, float]] = {}
        for c in pair.capacities:
            weights: dict[int, float] = {}
            for n in c.norms:
                j = term(s.of_norm(pair, n))
                weights[j] = weights.get(j, 0.0) + n.weight
            made[c.sense] = weights
            rows.append(Row(none, {size: 1.0, **{j: -w for j, w in weights.items()}}, when=(size, c.sense) if c.sense else None))
        holds.append(made)
        if pair.across is not None:
            force = term(s.of_norm(pair, Norm(pair.across, 1.0)))
            across.append(Across(force, size, made[0][force]))
    return Program(tuple(terms), tuple(rows), Row(none), tuple(across)), sizes, holds
