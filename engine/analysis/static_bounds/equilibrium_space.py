"""All states in equilibrium as an affine space, and the limits of friction as a program of norms.

A state is x = x₀ + B y, where y (N) are the amounts of the open directions. Each column of B is such a direction: a self-balanced
change of contact forces, frictions and the free load. B is scaled so that a unit vector y changes the forces by a vector of norm 1.
All forces are relative to a scale of the loads.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from trunnion.analysis.static_bounds.equilibrium_equations import FrictionJoint, Statics
from trunnion.analysis.static_bounds.sum_of_norms_program import Across, Program, Row, term_index
from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact.static_friction_capacity import Norm, Pair

RANK = 1e-9
"""A singular value counts as zero below this multiple of the largest (round-off is 1e-14; real directions exceed 1e-6)."""


@dataclass(frozen=True)
class Space:
    """All states in equilibrium.

    Attributes:
        statics: the equations.
        pairs: the frictional pairs.
        origin: x₀ (n).
        basis: B (n × d).
        load: index of the free load, whose amount is the last entry of x; None if no load is free.
        scale: scale of forces, N.
        misses: residual of the equations relative to the loads; large if a freedom cannot be in balance.
    """

    statics: Statics
    pairs: tuple[Pair, ...]
    origin: np.ndarray
    basis: np.ndarray
    load: int | None
    scale: float
    misses: float

    @property
    def open(self) -> int:
        """Number of open directions."""
        return self.basis.shape[1]

    @property
    def undetermined(self) -> int:
        """Number of open directions. Separating forces of toothed wheels do not count, because the driving forces determine
        them."""
        return self.open - len(_toothed(self.statics))

    def x(self, X: np.ndarray) -> np.ndarray:
        """The state x (n) at X = [y; 1], in units of the scale."""
        return self.scale * (self.basis @ X[:-1] + self.origin * X[-1])

    def reactions(self, x: np.ndarray) -> np.ndarray:
        """Reaction components of a state (nn)."""
        rows, constant = _reaction_map(self.statics, self.load)
        return rows @ x + constant

    def functional(self, rows: np.ndarray, constant: np.ndarray) -> np.ndarray:
        """The linear functions rows · x + constant of a state x, as rows over X."""
        return np.column_stack([rows @ self.basis, rows @ self.origin + constant / self.scale])

    def norm_vector(self, pair: Pair, n: Norm) -> np.ndarray:
        """The vector of a norm as rows over X."""
        rows, constant = _contact(self.statics, self.load, pair, n)
        return self.functional(rows, constant)

    def friction(self, pair: Pair) -> np.ndarray:
        """Friction of a pair at the surface as rows over X."""
        rows = _friction_rows(self.statics, len(self.origin), pair)
        return self.functional(rows, np.zeros(len(rows)))

    def amount(self, index: int) -> np.ndarray:
        """An entry of x as a row over X."""
        row = np.zeros((1, len(self.origin)))
        row[0, index] = 1.0
        return self.functional(row, np.zeros(1))[0]


def space(st: Statics, pairs: tuple[Pair, ...], load: int | None = None) -> Space:
    """States in equilibrium with all loads at their present amounts, except the load with index ``load``, which is free."""
    E = st.balance if load is None else np.column_stack([st.balance, st.by_load[:, load]])
    now = st.now.copy()
    if load is not None:
        now[load] = 0.0
    e = st.constant + st.by_load @ now
    smooth = [st.eta0 + k for j in st.joints if not j.element.sets for k in j.rubs.eta]  # pairs without friction at rest have η = 0
    light = range(st.eta0 - len(st.system.light), st.eta0)  # at rest, the multipliers that remove an added inertia are 0
    zero = [*light, *smooth]
    strands, pull = _strands(st, E.shape[1])
    E, e = np.vstack([E, np.eye(E.shape[1])[zero], strands]), np.concatenate([e, np.zeros(len(zero)), pull])
    origin, null, misses = _solutions(E, e, st.force)
    looks = _force_rows(st, pairs, load)
    seen = looks[:, :-1] @ null
    U, sizes, Vt = np.linalg.svd(seen, full_matrices=False) if seen.size else (seen, np.zeros(0), np.zeros((0, null.shape[1])))
    unit = np.abs(looks[:, :-1]).max(initial=0.0) * np.abs(null).max(initial=0.0)
    keep = sizes > RANK * max(unit, 1e-300)  # the largest singular value may itself be round-off, so it cannot serve as scale
    basis = null @ (Vt[keep].T / sizes[keep])
    at = looks[:, :-1] @ origin + looks[:, -1]
    origin = origin - basis @ (U[:, keep].T @ at)
    size = float(np.abs(looks[:, :-1] @ origin + looks[:, -1]).max(initial=0.0))
    scale = size if size > 1e-9 * st.force else st.force
    return Space(st, pairs, origin / scale, basis, load, scale, misses)


def _strands(st: Statics, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """(rows, constants) of the equations of belts. In these equations, the second multiplier is the sum of the tensions, a linear
    function of the first multiplier."""
    rows, constants = np.zeros((0, columns)), np.zeros(0)
    for j in st.joints:
        found = j.element.contact.tensions
        if found is None or not j.element.contact.bound:
            continue
        none, unit = (sum(map(float, found(eta, j.rubs.sizes))) for eta in (0.0, 1.0))
        row = np.zeros(columns)
        row[[st.eta0 + k for k in j.rubs.eta]] = none - unit, 1.0
        rows, constants = np.vstack([rows, row]), np.append(constants, -none)
    return rows, constants


def _driving_row(st: Statics, width: int, joint: FrictionJoint) -> np.ndarray:
    """The driving force of teeth as a row over x (width). Raises SceneError if the reactions of the joint depend on several
    multipliers of the loop constraints."""
    by = np.linalg.norm(st.reaction[joint.reactions, : st.eta0], axis=0)
    found = np.flatnonzero(by > RANK * by.max(initial=0.0))
    if len(found) > 1:
        what = f"the reactions of its teeth depend on {len(found)} multipliers, so that bounds at rest are not available"
        raise SceneError([Problem(f"joints.{joint.rubs.joint}", what, "use --hold without --bounds")])
    row = np.zeros(width)
    row[found] = by[found]
    return row


def _toothed(st: Statics) -> list[tuple[FrictionJoint, int, float]]:
    """(joint, index in x of the force along its bound freedom, this force divided by the driving force) of all joints with
    teeth."""
    return [
        (j, st.eta0 + j.rubs.eta[j.element.contact.bound[0]], found(j.rubs.sizes))
        for j in st.joints
        if (found := j.element.contact.separation) is not None
    ]


def _solutions(E: np.ndarray, e: np.ndarray, force: float) -> tuple[np.ndarray, np.ndarray, float]:
    """(a solution x of E x + e = 0, a basis of the null space of E, residual relative to e)."""
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


def _contact(st: Statics, load: int | None, pair: Pair, n: Norm) -> tuple[np.ndarray, np.ndarray]:
    """(rows over x, constants) of the vector of a norm."""
    R, constant = _reaction_map(st, load)
    mine = st.joint(pair.joint).reactions
    rows = n.rows @ R[mine]
    if n.own:
        rows[0] += n.own * _friction_rows(st, rows.shape[1], pair)[0]
    if n.drives:
        rows[0] += n.drives * _driving_row(st, rows.shape[1], st.joint(pair.joint))
    return rows, n.rows @ constant[mine] + n.added


def _friction_rows(st: Statics, width: int, pair: Pair) -> np.ndarray:
    """Friction of a pair at the surface as rows over x (width)."""
    rows = np.zeros((len(pair.eta), width))
    for k, eta in enumerate(pair.eta):
        rows[:, st.eta0 + eta] = pair.friction[:, k]
    return rows


def _force_rows(st: Statics, pairs: tuple[Pair, ...], load: int | None) -> np.ndarray:
    """Contact forces, frictions and efforts, N, as rows over [x; 1]."""
    n = st.balance.shape[1] + (load is not None)
    out: list[np.ndarray] = [np.zeros((0, n + 1))]
    for pair in pairs:
        for c in pair.capacities:
            for norm in c.norms:
                out.append(np.column_stack(_contact(st, load, pair, norm)))
        out.append(_friction_rows(st, n + 1, pair))
    out += [np.eye(1, n + 1, bound) for _, bound, _ in _toothed(st)]
    for k, effort in enumerate([*st.drives, *([] if load is None else [st.loads[load]])]):
        row = np.zeros((1, n + 1))
        row[0, st.multipliers + k] = 1.0 if effort.unit == "N" else 1.0 / st.length
        out.append(row)
    return np.vstack(out)


def holding_program(s: Space) -> tuple[Program, list[int], list[dict[int, dict[int, float]]]]:
    """(program of all admissible states, index of the term of each pair's friction, {sense of friction: {term: weight}} of each
    pair's capacity)."""
    terms: list[np.ndarray] = []
    rows: list[Row] = []
    across: list[Across] = []
    sizes: list[int] = []
    holds: list[dict[int, dict[int, float]]] = []
    none, term = np.zeros(s.open + 1), partial(term_index, terms)
    for pair in s.pairs:
        size = term(s.friction(pair))
        sizes.append(size)
        made: dict[int, dict[int, float]] = {}
        for c in pair.capacities:
            weights: dict[int, float] = {}
            for n in c.norms:
                j = term(s.norm_vector(pair, n))
                weights[j] = weights.get(j, 0.0) + n.weight
            made[c.sense] = weights
            rows.append(Row(none, {size: 1.0, **{j: -w for j, w in weights.items()}}, when=(size, c.sense) if c.sense else None))
        holds.append(made)
        if pair.across is not None:
            force = term(s.norm_vector(pair, Norm(pair.across, 1.0)))
            across.append(Across(force, size, made[0][force]))
    for joint, bound, separation in _toothed(s.statics):
        drives = s.functional(_driving_row(s.statics, len(s.origin), joint)[None, :], np.zeros(1))
        rows.append(Row(s.amount(bound), {term(drives): -separation}, equal=True))
    return Program(tuple(terms), tuple(rows), Row(none), tuple(across)), sizes, holds
