"""Programs of norms: least linear or norm values over linear rows in which norms of linear functions stand on either side.

Variables are X = [y; τ] and for every term j the number t_j = |V_j X|; τ is 1, or the free scale of a homogeneous program, whose
``normal`` row is 1 (so that quotients have their least value). A row is  linear·X + Σ coefficient·t  ≤ 0 (or = 0).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

FAR = 1e4
"""Amounts of open directions beyond this many times the loads count as unbounded: what is asked has no end there for a designer."""


@dataclass(frozen=True)
class Row:
    """linear (d + 1) · X + Σ norms[j] t_j, ≤ 0 or = 0. when: (term of one component, sign) for which alone it holds."""

    linear: np.ndarray
    norms: dict[int, float] = field(default_factory=dict)
    equal: bool = False
    when: tuple[int, int] | None = None

    def value(self, X: np.ndarray, t: np.ndarray) -> float:
        """What the left side is."""
        return float(self.linear @ X) + sum(c * t[j] for j, c in self.norms.items())


@dataclass(frozen=True)
class Across:
    """The vector of term ``moment`` is perpendicular to that of term ``force`` and at most ``most`` times as long."""

    force: int
    moment: int
    most: float


@dataclass(frozen=True)
class Program:
    """terms: V_j (k × (d + 1)); rows; across; objective, which is made least; normal: the row that is 1 where the program is
    homogeneous, else None."""

    terms: tuple[np.ndarray, ...]
    rows: tuple[Row, ...]
    objective: Row
    across: tuple[Across, ...] = ()
    normal: Row | None = None

    @property
    def width(self) -> int:
        """d + 1."""
        return len(self.objective.linear)

    def norms(self, X: np.ndarray) -> np.ndarray:
        """True values of all terms at X."""
        return np.array([float(np.linalg.norm(V @ X)) for V in self.terms])

    def scaled(self, X: np.ndarray) -> np.ndarray | None:
        """X moved along its ray to where the program is normal; None where there is no such place."""
        if self.normal is None:
            return X
        size = self.normal.value(X, self.norms(X))
        return X / size if size > 0.0 else None

    def broken(self, X: np.ndarray) -> float:
        """By how much X breaks the rows, the largest."""
        t = self.norms(X)
        worst = 0.0
        for row in self.rows:
            if row.when is not None and row.when[1] * float(self.terms[row.when[0]][0] @ X) <= 0.0:
                continue
            value = row.value(X, t)
            worst = max(worst, abs(value) if row.equal else value)
        for a in self.across:
            worst = max(worst, abs(float((self.terms[a.force] @ X) @ (self.terms[a.moment] @ X))) / max(t[a.force], 1e-12))
        return worst

    def asking(self, objective: Row, rows: tuple[Row, ...] = (), normal: Row | None = None) -> Program:
        """The same program with another objective, more rows, or homogeneous."""
        return replace(self, objective=objective, rows=(*self.rows, *rows), normal=normal)

    def concave(self) -> np.ndarray:
        """For every term the largest coefficient with which too large a t would help (0: never)."""
        out = np.zeros(len(self.terms))
        for row in (*self.rows, self.objective):
            for j, c in row.norms.items():
                out[j] = max(out[j], abs(c) if row.equal else -c)
        for j, c in (self.normal.norms if self.normal else {}).items():
            out[j] = max(out[j], abs(c))
        return out
