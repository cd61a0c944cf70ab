"""Linear relaxations of a program of norms over a cell, and linear programs that descend to a local minimum.

A cell restricts the vectors of some terms to simplicial cones: v = G a with a ≥ 0, where the columns of G are unit vectors. Then
u·v ≤ |v| ≤ Σ a for every unit vector u. The upper bound is exact along the columns of G. Its error is of second order in the
opening of the cone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from trunnion.analysis.static_bounds.linear_program_solver import Failed, LinearProgram
from trunnion.analysis.static_bounds.sum_of_norms_program import FAR, Program, Row
from trunnion.basics.lazy_data_classes import dataclass

FEASIBLE = 1e-9
"""Largest violation of a row, relative to the loads, at which a state counts as attained."""
BREAKING = 1e3
"""Penalty for a violated row in a descent. The largest multiplier observed was 10."""
STALLED, STALLS = 0.9, 3
"""A descent towards admissible states ends after STALLS steps that each leave more than the fraction STALLED of the largest
violation. Near an admissible state, a step reduces the violation to about its square."""
OLD = 12
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
    """The linear programs that relax one program with norms. A cut t ≥ u·v is valid in every cell and for every objective, so other
    solutions reuse it.

    over: returns whether to stop adding cuts. Certified values are valid with any number of cuts.
    """

    def __init__(self, program: Program, over: Callable[[], bool] = lambda: False):
        self.program, self.is_over = program, over
        self.n, self.m = program.width, len(program.terms)
        self.linear = LinearProgram()
        self.first = np.vstack(
            [np.zeros((0, self.n + self.m)), *(self._cut(j, _first_directions(len(V))) for j, V in enumerate(program.terms))]
        )
        self.cuts, self.ages = self.first[:0], np.zeros(0, int)

    def _cut(self, j: int, u: np.ndarray) -> np.ndarray:
        """The cuts t_j ≥ u·v_j for the rows u."""
        rows = np.zeros((len(u), self.n + self.m))
        rows[:, : self.n], rows[:, self.n + j] = u @ self.program.terms[j], -1.0
        return rows

    def _keep(self, cuts: np.ndarray) -> None:
        self.cuts, self.ages = np.vstack([self.cuts, cuts]), np.append(self.ages, np.zeros(len(cuts), int))

    def _box(self, normal: Row | None) -> tuple[np.ndarray, np.ndarray]:
        """The limits of [X; t] of the relaxation."""
        far = np.append(np.full(self.n - 1, FAR), 1.0 if normal is None else FAR)
        V, first = self.program.stacked
        most = np.sqrt(np.add.reduceat((np.abs(V) @ far) ** 2, first)) if self.m else np.zeros(0)
        low = np.append(-far, np.zeros(self.m))
        low[self.n - 1] = 1.0 if normal is None else 0.0
        return low, np.append(far, most + 1.0)

    def solve(self, cell: Cell) -> Answer | None:
        """The solution of the relaxation over a cell, with cuts added as needed; None if it is infeasible."""
        return next(self.solutions(cell, [self.program.objective], self.program.normal))

    def solutions(self, cell: Cell, objectives: list[Row], normal: Row | None = None) -> Iterator[Answer | None]:
        """The results of ``solve`` for several objectives over one cell. The program is homogeneous if ``normal`` is given."""
        costs = self.program.wide(tuple(objectives))
        upper, equal = self._rows(cell)
        right = np.zeros(len(equal) + (normal is not None) + len(upper))
        if normal is not None:
            equal = np.vstack([equal, self.program.wide((normal,))])
            right[len(equal) - 1] = 1.0
        rows = np.vstack([equal, upper, self.first, self.cuts])
        right = np.append(right, np.zeros(len(rows) - len(right)))
        self.linear.load(costs[0], rows, right, len(equal), *self._box(normal))
        for k, cost in enumerate(costs):
            if k:
                self.linear.set_cost(cost)
            yield self._solution()

    def _solution(self) -> Answer | None:
        """The solution of the loaded program, with cuts added as needed."""
        found = None
        for _ in range(12):
            found = self._solve()
            if found is None or self.is_over() or not len(cuts := self.missing(found)):
                return found
            self._keep(cuts)
            self.linear.add(cuts)
        return found

    def missing(self, a: Answer) -> np.ndarray:
        """The cuts for norms that the solution underestimates. Norms of one component get no cut, because all their cuts exist from
        the beginning. Only the tolerance of the linear program makes the solution underestimate such a norm."""
        size = self.program.norms(a.X)
        return self._tangents(a.X, size - a.t > 1e-10 * np.maximum(1.0, size))

    def _tangents(self, X: np.ndarray, terms: np.ndarray) -> np.ndarray:
        """The cuts that touch the norms of these terms (mask) at X. A norm that is zero or has one component gets no cut."""
        V, first = self.program.stacked
        at = np.flatnonzero(terms & (self.program.norms(X) > 0.0) & (np.diff(np.append(first, len(V))) > 1))
        cuts = np.zeros((len(at), self.n + self.m))
        cuts[:, : self.n] = self.program.slopes(X)[at]
        cuts[np.arange(len(at)), self.n + at] = -1.0
        return cuts

    def climb(self, X: np.ndarray, low: float, close: float, rounds: int = 20) -> np.ndarray | None:
        """The best state of a descent from X; None if no admissible state is found. low: lower bound of the value. close: the
        descent ends if a step gains less than this value.

        The linear programs of the descent replace each norm that must be large by its tangent. A tangent never exceeds its norm, so
        the solutions are admissible.
        """
        best, value, missed, stalls, p = None, np.inf, np.inf, 0, self.program
        if float(np.abs(X).max()) < 1e-9:  # norms have no tangents at X = 0: use another start
            X = np.append(np.zeros(self.n - 1), 1.0)
        for _ in range(rounds):
            if self.is_over():
                break
            found = self._descend(X)
            at = None if found is None else p.scaled(found.X)
            if at is None:
                break
            moved, misses, X = float(np.abs(at - X).max()), p.violation(at), at
            if misses <= FEASIBLE:
                now, before = p.objective.value(at, p.norms(at)), value
                if now < value:
                    best, value = at, now
                if value - low <= close or now >= before - close:
                    break
            stalls = 0 if misses <= STALLED * missed else stalls + 1
            missed = misses
            if stalls == STALLS or moved <= 1e-12 * max(1.0, float(np.abs(X).max())):
                break
        return best

    def _descend(self, X: np.ndarray) -> Answer | None:
        """One linear program of the descent at X. A common slack variable with a penalty relaxes the rows, so that any X is a valid
        start."""
        p = self.program
        self._keep(self._tangents(X, np.ones(self.m, bool)))
        rows = self._tangent(X)
        cuts = np.vstack([self.first, self.cuts])
        wide = np.column_stack([np.vstack([rows, cuts]), np.append(np.full(len(rows), -1.0), np.zeros(len(cuts)))])
        cost = np.append(self._tangent_rows((p.objective,), X)[0], BREAKING)
        right, equal = np.zeros(len(wide)), 0
        if p.normal is not None:
            scale = self._tangent_rows((p.normal,), X, every=True)
            wide, right, equal = np.vstack([np.append(scale[0], 0.0), wide]), np.append(1.0, right), 1
        low, high = self._box(p.normal)
        low[self.n :] = -high[self.n :]
        self.linear.load(cost, wide, right, equal, np.append(low, 0.0), np.append(high, np.inf))
        return self._solve()

    def _tangent(self, X: np.ndarray) -> np.ndarray:
        """Rows ≤ 0 of the descent at X. A variable t with cuts replaces a norm that must be small; u·v replaces a norm that must
        be large."""
        p = self.program
        applies = p.senses(X) >= 0.0
        rows, equal = self._tangent_rows(p.rows, X)[applies], p.equal[applies]
        when = [r.when for r, a in zip(p.rows, applies, strict=True) if a and r.when is not None]
        signs, across = np.zeros((len(when), self.n + self.m)), np.zeros((len(p.across), self.n + self.m))
        for row, (j, sign) in zip(signs, when, strict=True):
            row[: self.n] = -sign * p.terms[j][0]
        for row, a in zip(across, p.across, strict=True):
            force, moment = p.terms[a.force] @ X, p.terms[a.moment] @ X
            row[: self.n] = force @ p.terms[a.moment] + moment @ p.terms[a.force]
            row[self.n - 1] -= float(force @ moment)
            row /= max(float(np.linalg.norm(force)), 1e-9)
        return np.vstack([rows[~equal], signs, rows[equal], across, -rows[equal], -across])

    def _tangent_rows(self, rows: tuple[Row, ...], X: np.ndarray, every: bool = False) -> np.ndarray:
        """Rows in which the tangents u·v at X replace the norms that must be large (with ``every``: all norms)."""
        p = self.program
        wide = p.weights.copy() if rows is p.rows else p.wide(rows)
        equal = np.array([every or r.equal for r in rows], bool)
        large = np.where(equal[:, None] | (wide[:, self.n :] < 0.0), wide[:, self.n :], 0.0)
        wide[:, : self.n] += large @ p.slopes(X)
        wide[:, self.n :] -= large
        return wide

    def _rows(self, cell: Cell) -> tuple[np.ndarray, np.ndarray]:
        """(rows ≤ 0, rows = 0) of the relaxation over a cell."""
        p = self.program
        applies = np.array([r.when is None or (r.when[0] in cell and cell[r.when[0]][0, 0] == r.when[1]) for r in p.rows], bool)
        upper = [p.weights[applies & ~p.equal]]
        for j, G in cell.items():
            inside = np.zeros((len(G) + 1, self.n + self.m))
            inside[:-1, : self.n] = -np.linalg.solve(G, p.terms[j])
            inside[-1, : self.n] = inside[:-1, : self.n].sum(axis=0)
            inside[-1, self.n + j] = 1.0
            upper.append(inside)
        upper += [self._perpendicular_rows(cell[a.force], a.force, a.moment, a.most) for a in p.across if a.force in cell]
        return np.vstack(upper), p.weights[applies & p.equal]

    def _perpendicular_rows(self, G: np.ndarray, force: int, moment: int, most: float) -> np.ndarray:
        """Rows for a moment perpendicular to a force in the cone G. The moment's component along the axis of the cone is at most
        sin(opening) times ``most`` times the norm of the force."""
        u = G.sum(axis=1)
        u /= np.linalg.norm(u)
        sine = float(np.sqrt(max(0.0, 1.0 - float((u @ G).min()) ** 2)))
        out = np.zeros((2, self.n + self.m))
        out[:, : self.n] = np.outer((1.0, -1.0), u @ self.program.terms[moment])
        out[:, self.n + force] = -sine * most
        return out

    def _solve(self) -> Answer | None:
        """The solution of the loaded program; None if it is infeasible.

        If the solver fails, the value is −∞ and the norms are large, so that the search cuts the cell.
        """
        try:
            found = self.linear.solve()
        except Failed:
            return Answer(-np.inf, np.append(np.zeros(self.n - 1), 1.0), np.full(self.m, FAR))
        if found is None:
            return None
        value, x = found
        self._forget(x[: self.n + self.m])
        return Answer(value, x[: self.n], x[self.n : self.n + self.m])

    def _forget(self, x: np.ndarray) -> None:
        """Drop cuts that were not needed recently. The first cuts are always kept."""
        if len(self.cuts):
            self.ages = np.where(np.abs(self.cuts @ x) < 1e-7, 0, self.ages + 1)
            kept = self.ages < OLD
            self.cuts, self.ages = self.cuts[kept], self.ages[kept]


def _first_directions(k: int) -> np.ndarray:
    """Directions of the first cuts of a norm of k components."""
    if k == 2:
        angles = np.arange(8) * np.pi / 4
        return np.column_stack([np.cos(angles), np.sin(angles)])
    return np.vstack([np.eye(k), -np.eye(k)])
