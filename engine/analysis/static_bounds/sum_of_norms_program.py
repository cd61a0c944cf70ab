"""Programs of norms: minimise a sum of linear functions and norms, subject to constraints of the same form.

The variables are X = [y; τ]. Every term j has the norm t_j = |V_j X|. A row is the constraint linear·X + Σ coefficient·t ≤ 0 (or =
0). Normally τ = 1. In a homogeneous program, τ is free and the ``normal`` row equals 1. The minimum is then the minimum of the
quotient objective/normal.
"""

from __future__ import annotations

from dataclasses import field, replace
from functools import cached_property

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass

FAR = 1e4
"""Limit of the amounts of open directions, in multiples of the loads. Amounts near this limit count as unbounded."""


@dataclass(frozen=True)
class Row:
    """The constraint linear·X + Σ norms[j] t_j ≤ 0, or = 0 if ``equal``; linear has d + 1 entries. when: (term of one component,
    sign); the constraint applies only if this component has this sign."""

    linear: np.ndarray
    norms: dict[int, float] = field(default_factory=dict)
    equal: bool = False
    when: tuple[int, int] | None = None

    def value(self, X: np.ndarray, t: np.ndarray) -> float:
        """The left side of the constraint at X (d + 1) and t."""
        return float(self.linear @ X) + sum(c * t[j] for j, c in self.norms.items())


def term_index(terms: list[np.ndarray], V: np.ndarray) -> int:
    """The index of V among the terms. V is appended if it is missing."""
    found = next((j for j, other in enumerate(terms) if other.shape == V.shape and np.array_equal(other, V)), len(terms))
    terms += [V] if found == len(terms) else []
    return found


@dataclass(frozen=True)
class Across:
    """The vector of term ``moment`` is perpendicular to the vector of term ``force``, and at most ``most`` times as long."""

    force: int
    moment: int
    most: float


@dataclass(frozen=True)
class Program:
    """A program.

    Attributes:
        terms: the matrices V_j (k × (d + 1)).
        rows: the constraints.
        objective: the row to minimise.
        across: further constraints on pairs of perpendicular vectors.
        normal: the row that equals 1 in a homogeneous program; None in any other program.
    """

    terms: tuple[np.ndarray, ...]
    rows: tuple[Row, ...]
    objective: Row
    across: tuple[Across, ...] = ()
    normal: Row | None = None

    @property
    def width(self) -> int:
        """Number of entries of X, d + 1."""
        return len(self.objective.linear)

    @cached_property
    def stacked(self) -> tuple[np.ndarray, np.ndarray]:
        """(the matrices V_j stacked, index of the first row of each)."""
        return np.vstack([np.zeros((0, self.width)), *self.terms]), np.cumsum([0, *(len(V) for V in self.terms)])[:-1]

    @cached_property
    def weights(self) -> np.ndarray:
        """The rows over [X; t] (rows × (d + 1 + terms))."""
        return self.wide(self.rows)

    @cached_property
    def equal(self) -> np.ndarray:
        """Whether each row is an equation."""
        return np.array([row.equal for row in self.rows], bool)

    def wide(self, rows: tuple[Row, ...]) -> np.ndarray:
        """Rows over [X; t]."""
        out = np.zeros((len(rows), self.width + len(self.terms)))
        for wide, row in zip(out, rows, strict=True):
            wide[: self.width] = row.linear
            for j, c in row.norms.items():
                wide[self.width + j] += c
        return out

    def norms(self, X: np.ndarray) -> np.ndarray:
        """The norms |V_j X| of all terms."""
        V, first = self.stacked
        return np.sqrt(np.add.reduceat((V @ X) ** 2, first)) if len(first) else np.zeros(0)

    def slopes(self, X: np.ndarray) -> np.ndarray:
        """The derivatives of the norms at X (terms × (d + 1)). If a norm is zero, its row is the derivative of its first
        component."""
        V, first = self.stacked
        if not len(first):
            return np.zeros((0, self.width))
        v, size = V @ X, self.norms(X)
        v[first[size == 0.0]] = 1.0
        return np.add.reduceat(v[:, None] * V, first) / np.where(size > 0.0, size, 1.0)[:, None]

    def senses(self, X: np.ndarray) -> np.ndarray:
        """For each row: 1 if the row applies at X, −1 if not, and 0 if the component in its condition ``when`` is zero."""
        return np.array([1.0 if r.when is None else r.when[1] * np.sign(self.terms[r.when[0]][0] @ X) for r in self.rows])

    def scaled(self, X: np.ndarray) -> np.ndarray | None:
        """The positive multiple of X whose normal row equals 1; None if no multiple has this property. Without a normal row, the
        result is X itself."""
        if self.normal is None:
            return X
        size = self.normal.value(X, self.norms(X))
        return X / size if size > 0.0 else None

    def violation(self, X: np.ndarray) -> float:
        """The largest violation of all constraints at X."""
        t = self.norms(X)
        values = (self.weights @ np.append(X, t))[self.senses(X) > 0.0]
        worst = float(np.where(self.equal[self.senses(X) > 0.0], np.abs(values), values).max(initial=0.0))
        for a in self.across:
            worst = max(worst, abs(float((self.terms[a.force] @ X) @ (self.terms[a.moment] @ X))) / max(t[a.force], 1e-12))
        return worst

    def with_objective(self, objective: Row, rows: tuple[Row, ...] = (), normal: Row | None = None) -> Program:
        """The program with another objective and additional rows. It is homogeneous if ``normal`` is given."""
        return replace(self, objective=objective, rows=(*self.rows, *rows), normal=normal)

    def concave(self) -> np.ndarray:
        """For every term j, how much an overestimate of t_j relaxes the program. This is the largest size of a coefficient of t_j
        among the rows that the overestimate relaxes, or 0."""
        out = np.zeros(len(self.terms))
        for row in (*self.rows, self.objective):
            for j, c in row.norms.items():
                out[j] = max(out[j], abs(c) if row.equal else -c)
        for j, c in (self.normal.norms if self.normal else {}).items():
            out[j] = max(out[j], abs(c))
        return out
