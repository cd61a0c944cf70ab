"""Linear relaxations of a program of norms over a cell, and the linear programs that climb to a local least value.

A cell says of some terms in which simplicial cone their vector lies: v = G a, a ≥ 0, the columns of G unit vectors. There
u·v ≤ |v| ≤ Σ a for every unit vector u, with equality along the columns: cells need no bounds on sizes, and narrow ones are exact
to second order in their opening.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from engine.basics.extras import brought
from engine.bounds.program import FAR, Program, Row

optimize = brought("scipy.optimize", "analysis", "what bounds friction at rest")
LINEAR = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10, "presolve": False}
"""The smallest the solver takes: what is certified is certified to about this, of the loads. Programs are small: looking for what
can be left out of them takes longer than solving them."""
SOLVED, NONE = 0, 2
"""What ``linprog`` says of a program: solved, or that nothing is admissible."""
FEASIBLE = 1e-9
"""By how much an attained state may break a row, of the loads."""
BREAKING = 1e3
"""Price of breaking a row in a climb, per its unit: more than any row's multiplier that was seen (10)."""
OLD = 40
"""A cut that no linear program has needed for so many is forgotten."""
Cell = dict[int, np.ndarray]
"""Cones by term: G (k × k)."""


@dataclass(frozen=True)
class Answer:
    """A linear program's answer: its value and X, and what it took for the norms."""

    value: float
    X: np.ndarray
    t: np.ndarray


class Relaxation:
    """The linear programs of one program of norms. Cuts t ≥ u·v hold everywhere and are kept as they are found. over: whether to
    stop; what is certified is, with fewer cuts."""

    def __init__(self, program: Program, over: Callable[[], bool] = lambda: False):
        self.program, self.over = program, over
        self.n, self.m = program.width, len(program.terms)
        self.cuts: list[np.ndarray] = []
        self.ages: list[int] = []
        self.solved = 0
        for j, V in enumerate(program.terms):
            for u in _around(len(V)):
                self.cut(j, u)
        self.first = len(self.cuts)
        span: tuple[float, float | None] = (-FAR, FAR)
        far = np.append(np.full(self.n - 1, FAR), 1.0 if program.normal is None else FAR)
        most = [float(np.linalg.norm(np.abs(V) @ far)) + 1.0 for V in program.terms]
        tau: tuple[float, float | None] = (1.0, 1.0) if program.normal is None else (0.0, FAR)
        self.box: list[tuple[float, float | None]] = [span] * (self.n - 1) + [tau] + [(0.0, b) for b in most]
        self.free: list[tuple[float, float | None]] = [span] * (self.n - 1) + [tau] + [(-b, b) for b in most]

    def cut(self, j: int, u: np.ndarray) -> None:
        """Remember t_j ≥ u·v_j."""
        row = np.zeros(self.n + self.m)
        row[: self.n], row[self.n + j] = u @ self.program.terms[j], -1.0
        self.cuts.append(row)
        self.ages.append(0)

    def solve(self, cell: Cell) -> Answer | None:
        """The relaxation over a cell, with cuts added until it needs none; None where nothing is admissible."""
        found = None
        upper, equal = self._rows(cell)
        normal = None if self.program.normal is None else self._straight(self.program.normal)
        for _ in range(12):
            found = self._linear(self._straight(self.program.objective), [*upper, *self.cuts], equal, normal, self.box)
            if found is None or self.over() or not self._cut_off(found):
                return found
        return found

    def _cut_off(self, a: Answer) -> bool:
        """Add cuts where the answer takes a norm for less than it is."""
        more = False
        for j, V in enumerate(self.program.terms):
            v = V @ a.X
            size = float(np.linalg.norm(v))
            if size - a.t[j] > 1e-10 * max(1.0, size) and len(v) > 1:
                self.cut(j, v / size)
                more = True
        return more

    def climb(self, X: np.ndarray, rounds: int = 20) -> np.ndarray | None:
        """From X by linear programs in which norms that help when large stand for their tangent, which is never more than they
        are, so that what such a program admits is admissible."""
        best, value, p = None, np.inf, self.program
        if float(np.abs(X).max()) < 1e-9:  # where a homogeneous relaxation is at rest, norms have no tangent
            X = np.append(np.zeros(self.n - 1), 1.0)
        for _ in range(rounds):
            if self.over():
                break
            normal = None if p.normal is None else self._leaning(replace(p.normal, equal=True), X)
            found = self._elastic(self._leaning(p.objective, X), self._tangent(X), normal)
            at = None if found is None else p.scaled(found.X)
            if at is None:
                break
            now = p.objective.value(at, p.norms(at)) if p.broken(at) <= FEASIBLE else np.inf
            moved = float(np.abs(at - X).max())
            X = at
            if now < value:
                best, value = at, now
            if moved <= 1e-12 * max(1.0, float(np.abs(X).max())):
                break
        return best

    def _elastic(self, cost: np.ndarray, rows: list[np.ndarray], normal: np.ndarray | None) -> Answer | None:
        """The linear program of a climb, in which every row may be broken at a price, so that it begins anywhere."""
        wide = [np.append(r, -1.0) for r in rows] + [np.append(r, 0.0) for r in self.cuts]
        scale = None if normal is None else np.append(normal, 0.0)
        return self._linear(np.append(cost, BREAKING), wide, [], scale, [*self.free, (0.0, None)])

    def _tangent(self, X: np.ndarray) -> list[np.ndarray]:
        """Its rows ≤ 0. A norm that must be small keeps its cuts, in a variable t; one that helps when large is u·v."""
        p = self.program
        upper: list[np.ndarray] = []
        equal: list[np.ndarray] = []
        self._cut_at(X)
        for row in p.rows:
            if row.when is not None and row.when[1] * float(p.terms[row.when[0]][0] @ X) < 0.0:
                continue
            (equal if row.equal else upper).append(self._leaning(row, X))
            if row.when is not None:
                sign = np.zeros(self.n + self.m)
                sign[: self.n] = -row.when[1] * p.terms[row.when[0]][0]
                upper.append(sign)
        for a in p.across:
            sign = np.zeros(self.n + self.m)
            sign[: self.n] = (p.terms[a.force] @ X) @ p.terms[a.moment] + (p.terms[a.moment] @ X) @ p.terms[a.force]
            sign[self.n - 1] -= float((p.terms[a.force] @ X) @ (p.terms[a.moment] @ X))
            equal.append(sign / max(float(np.linalg.norm(p.terms[a.force] @ X)), 1e-9))
        return [*upper, *equal, *(-e for e in equal)]

    def _cut_at(self, X: np.ndarray) -> None:
        for j, V in enumerate(self.program.terms):
            v = V @ X
            if len(v) > 1 and (size := float(np.linalg.norm(v))) > 0.0:
                self.cut(j, v / size)

    def _leaning(self, row: Row, X: np.ndarray) -> np.ndarray:
        out = np.zeros(self.n + self.m)
        out[: self.n] = row.linear
        for j, c in row.norms.items():
            if row.equal or c < 0.0:
                v = self.program.terms[j] @ X
                out[: self.n] += c * _unit(v) @ self.program.terms[j]
            else:
                out[self.n + j] += c
        return out

    def _rows(self, cell: Cell) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """(rows ≤ 0, rows = 0) of the relaxation over a cell."""
        upper: list[np.ndarray] = []
        equal: list[np.ndarray] = []
        for row in self.program.rows:
            if row.when is not None and not (row.when[0] in cell and cell[row.when[0]][0, 0] == row.when[1]):
                continue
            (equal if row.equal else upper).append(self._straight(row))
        for j, G in cell.items():
            inside = np.linalg.solve(G, self.program.terms[j])
            for a in -inside:
                upper.append(np.append(a, np.zeros(self.m)))
            above = np.append(-inside.sum(axis=0), np.zeros(self.m))
            above[self.n + j] = 1.0
            upper.append(above)
        for a in self.program.across:
            if a.force in cell:
                upper += self._nearly_across(cell[a.force], a.force, a.moment, a.most)
        return upper, equal

    def _nearly_across(self, G: np.ndarray, force: int, moment: int, most: float) -> list[np.ndarray]:
        """A vector perpendicular to one in the cone has little along the cone's middle u: at most sin(opening) of its length."""
        u = G.sum(axis=1)
        u /= np.linalg.norm(u)
        sine = float(np.sqrt(max(0.0, 1.0 - float((u @ G).min()) ** 2)))
        out = []
        for s in (1.0, -1.0):
            row = np.append(s * u @ self.program.terms[moment], np.zeros(self.m))
            row[self.n + force] = -sine * most
            out.append(row)
        return out

    def _straight(self, row: Row) -> np.ndarray:
        out = np.append(row.linear, np.zeros(self.m))
        for j, c in row.norms.items():
            out[self.n + j] += c
        return out

    def _linear(
        self, cost: np.ndarray, upper: list[np.ndarray], equal: list[np.ndarray], normal: np.ndarray | None,
        box: list[tuple[float, float | None]],
    ) -> Answer | None:  # fmt: skip
        """One linear program; None where nothing is admissible. One that the solver gives up has no lower bound and norms of any
        size, so that its cell is cut."""
        rows = equal if normal is None else [*equal, normal]
        right = [0.0] * len(equal) if normal is None else [*[0.0] * len(equal), 1.0]
        self.solved += 1
        A, b = (np.array(upper), np.zeros(len(upper))) if upper else (None, None)
        E, e = (np.array(rows), right) if rows else (None, None)
        for how in (LINEAR, {**LINEAR, "presolve": True}):
            found = optimize.linprog(cost, A, b, E, e, box, "highs-ds", options=how)
            if found.status in (SOLVED, NONE):
                break
        if found.status == NONE:
            return None
        if found.status != SOLVED:
            return Answer(-np.inf, np.append(np.zeros(self.n - 1), 1.0), np.full(self.m, FAR))
        self._forget(found.x[: self.n + self.m])
        return Answer(float(found.fun), found.x[: self.n], found.x[self.n : self.n + self.m])

    def _forget(self, x: np.ndarray) -> None:
        """Drop cuts that were not needed for long; the first ones stay."""
        if len(self.cuts) > self.first:
            needed = np.abs(np.array(self.cuts) @ x) < 1e-7
            self.ages = [0 if n else a + 1 for n, a in zip(needed, self.ages, strict=True)]
            kept = [k for k, a in enumerate(self.ages) if k < self.first or a < OLD]
            self.cuts, self.ages = [self.cuts[k] for k in kept], [self.ages[k] for k in kept]


def _unit(v: np.ndarray) -> np.ndarray:
    size = float(np.linalg.norm(v))
    return v / size if size > 0.0 else np.eye(len(v))[0]


def _around(k: int) -> list[np.ndarray]:
    """Directions of the first cuts of a norm of k components."""
    if k == 2:
        return [np.array([np.cos(a), np.sin(a)]) for a in np.arange(8) * np.pi / 4]
    return [s * e for e in np.eye(k) for s in (1.0, -1.0)]
