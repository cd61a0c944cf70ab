"""Linear relaxations of a program of norms over a cell, and linear programs that descend to a local minimum.

A cell restricts the vectors of some terms to simplicial cones: v = G a with a ≥ 0, where the columns of G are unit vectors. Then
u·v ≤ |v| ≤ Σ a for every unit vector u. The upper bound is exact along the columns of G. Its error is of second order in the
opening of the cone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from trunnion.analysis.static_bounds.norm_program import FAR, Program, Row
from trunnion.basics.optional_packages import brought

optimize = brought("scipy.optimize", "analysis", "the analysis of friction bounds")
LINEAR = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10, "presolve": False}
"""The smallest tolerances of the solver, relative to the loads. These tolerances limit the accuracy of certified values. Presolving
is off, because for small programs it costs more time than it saves."""
SOLVED, NONE = 0, 2
"""Statuses of ``linprog``: solved, infeasible."""
FEASIBLE = 1e-9
"""Largest violation of a row, relative to the loads, at which a state counts as attained."""
BREAKING = 1e3
"""Penalty for a violated row in a descent. The largest multiplier observed was 10."""
OLD = 40
"""A cut is dropped if this number of successive linear programs did not need it."""
Cell = dict[int, np.ndarray]
"""{term: matrix G (k × k) of its cone}."""


@dataclass(frozen=True)
class Answer:
    """The solution of a linear program: its value, X, and the variables t that replace the norms."""

    value: float
    X: np.ndarray
    t: np.ndarray


class Relaxation:
    """The linear programs that relax one program with norms. A cut t ≥ u·v is valid in every cell, so other cells reuse it.

    over: returns whether to stop adding cuts. Certified values are valid with any number of cuts.
    """

    def __init__(self, program: Program, over: Callable[[], bool] = lambda: False):
        self.program, self.is_over = program, over
        self.n, self.m = program.width, len(program.terms)
        self.cuts: list[np.ndarray] = []
        self.ages: list[int] = []
        self.solved = 0
        for j, V in enumerate(program.terms):
            for u in _first_directions(len(V)):
                self.cut(j, u)
        self.first = len(self.cuts)
        span: tuple[float, float | None] = (-FAR, FAR)
        far = np.append(np.full(self.n - 1, FAR), 1.0 if program.normal is None else FAR)
        most = [float(np.linalg.norm(np.abs(V) @ far)) + 1.0 for V in program.terms]
        tau: tuple[float, float | None] = (1.0, 1.0) if program.normal is None else (0.0, FAR)
        self.box: list[tuple[float, float | None]] = [span] * (self.n - 1) + [tau] + [(0.0, b) for b in most]
        self.free: list[tuple[float, float | None]] = [span] * (self.n - 1) + [tau] + [(-b, b) for b in most]

    def cut(self, j: int, u: np.ndarray) -> None:
        """Add the cut t_j ≥ u·v_j."""
        row = np.zeros(self.n + self.m)
        row[: self.n], row[self.n + j] = u @ self.program.terms[j], -1.0
        self.cuts.append(row)
        self.ages.append(0)

    def solve(self, cell: Cell) -> Answer | None:
        """The solution of the relaxation over a cell, with cuts added as needed; None if it is infeasible."""
        found = None
        upper, equal = self._rows(cell)
        normal = None if self.program.normal is None else self._relaxed_row(self.program.normal)
        for _ in range(12):
            found = self._linear(self._relaxed_row(self.program.objective), [*upper, *self.cuts], equal, normal, self.box)
            if found is None or self.is_over() or not self._cut_off(found):
                return found
        return found

    def _cut_off(self, a: Answer) -> bool:
        """Add cuts where the solution underestimates a norm. Returns whether a cut was added."""
        more = False
        for j, V in enumerate(self.program.terms):
            v = V @ a.X
            size = float(np.linalg.norm(v))
            if size - a.t[j] > 1e-10 * max(1.0, size) and len(v) > 1:
                self.cut(j, v / size)
                more = True
        return more

    def climb(self, X: np.ndarray, rounds: int = 20) -> np.ndarray | None:
        """The best state of a descent from X; None if no admissible state is found.

        The linear programs of the descent replace norms that must be large by their tangents. A tangent never exceeds its norm, so
        the solutions are admissible.
        """
        best, value, p = None, np.inf, self.program
        if float(np.abs(X).max()) < 1e-9:  # a norm has no tangent at zero
            X = np.append(np.zeros(self.n - 1), 1.0)
        for _ in range(rounds):
            if self.is_over():
                break
            normal = None if p.normal is None else self._tangent_row(replace(p.normal, equal=True), X)
            found = self._elastic(self._tangent_row(p.objective, X), self._tangent(X), normal)
            at = None if found is None else p.scaled(found.X)
            if at is None:
                break
            now = p.objective.value(at, p.norms(at)) if p.violation(at) <= FEASIBLE else np.inf
            moved = float(np.abs(at - X).max())
            X = at
            if now < value:
                best, value = at, now
            if moved <= 1e-12 * max(1.0, float(np.abs(X).max())):
                break
        return best

    def _elastic(self, cost: np.ndarray, rows: list[np.ndarray], normal: np.ndarray | None) -> Answer | None:
        """One linear program of the descent. A common slack variable with a penalty relaxes the rows, so that any X is a valid
        start."""
        wide = [np.append(r, -1.0) for r in rows] + [np.append(r, 0.0) for r in self.cuts]
        scale = None if normal is None else np.append(normal, 0.0)
        return self._linear(np.append(cost, BREAKING), wide, [], scale, [*self.free, (0.0, None)])

    def _tangent(self, X: np.ndarray) -> list[np.ndarray]:
        """Rows ≤ 0 of the descent at X. A variable t with cuts replaces a norm that must be small; u·v replaces a norm that must
        be large."""
        p = self.program
        upper: list[np.ndarray] = []
        equal: list[np.ndarray] = []
        self._cut_at(X)
        for row in p.rows:
            if row.when is not None and row.when[1] * float(p.terms[row.when[0]][0] @ X) < 0.0:
                continue
            (equal if row.equal else upper).append(self._tangent_row(row, X))
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

    def _tangent_row(self, row: Row, X: np.ndarray) -> np.ndarray:
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
            (equal if row.equal else upper).append(self._relaxed_row(row))
        for j, G in cell.items():
            inside = np.linalg.solve(G, self.program.terms[j])
            for a in -inside:
                upper.append(np.append(a, np.zeros(self.m)))
            above = np.append(-inside.sum(axis=0), np.zeros(self.m))
            above[self.n + j] = 1.0
            upper.append(above)
        for a in self.program.across:
            if a.force in cell:
                upper += self._perpendicular_rows(cell[a.force], a.force, a.moment, a.most)
        return upper, equal

    def _perpendicular_rows(self, G: np.ndarray, force: int, moment: int, most: float) -> list[np.ndarray]:
        """Rows for a moment perpendicular to a force in the cone G. The moment's component along the axis of the cone is at most
        sin(opening) times ``most`` times the norm of the force."""
        u = G.sum(axis=1)
        u /= np.linalg.norm(u)
        sine = float(np.sqrt(max(0.0, 1.0 - float((u @ G).min()) ** 2)))
        out = []
        for s in (1.0, -1.0):
            row = np.append(s * u @ self.program.terms[moment], np.zeros(self.m))
            row[self.n + force] = -sine * most
            out.append(row)
        return out

    def _relaxed_row(self, row: Row) -> np.ndarray:
        out = np.append(row.linear, np.zeros(self.m))
        for j, c in row.norms.items():
            out[self.n + j] += c
        return out

    def _linear(
        self, cost: np.ndarray, upper: list[np.ndarray], equal: list[np.ndarray], normal: np.ndarray | None,
        box: list[tuple[float, float | None]],
    ) -> Answer | None:  # fmt: skip
        """The solution of one linear program; None if it is infeasible.

        If the solver fails, the value is −∞ and the norms are large, so that the search cuts the cell.
        """
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
        """Drop cuts that were not needed recently. The first cuts are always kept."""
        if len(self.cuts) > self.first:
            needed = np.abs(np.array(self.cuts) @ x) < 1e-7
            self.ages = [0 if n else a + 1 for n, a in zip(needed, self.ages, strict=True)]
            kept = [k for k, a in enumerate(self.ages) if k < self.first or a < OLD]
            self.cuts, self.ages = [self.cuts[k] for k in kept], [self.ages[k] for k in kept]


def _unit(v: np.ndarray) -> np.ndarray:
    size = float(np.linalg.norm(v))
    return v / size if size > 0.0 else np.eye(len(v))[0]


def _first_directions(k: int) -> list[np.ndarray]:
    """Directions of the first cuts of a norm of k components."""
    if k == 2:
        return [np.array([np.cos(a), np.sin(a)]) for a in np.arange(8) * np.pi / 4]
    return [s * e for e in np.eye(k) for s in (1.0, -1.0)]
