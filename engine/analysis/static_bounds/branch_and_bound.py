"""The certified minimum of a program of norms, by spatial branch and bound over the directions of its vectors."""

from __future__ import annotations

import heapq
import itertools

import numpy as np

from trunnion.analysis.static_bounds.linear_relaxation import FEASIBLE, Answer, Cell, Relaxation
from trunnion.analysis.static_bounds.search_budget import SearchBudget
from trunnion.analysis.static_bounds.sum_of_norms_program import FAR, Program
from trunnion.basics.lazy_data_classes import dataclass

CLOSE = 1e-9
"""A search ends if the gap between the attained and the certified value, relative to the value and to the loads, is below this
value."""
LIMIT = 0.98 * FAR
"""If the amount of an open direction reaches this limit, the value is reported as unbounded."""
EXACT = 1e-11
"""An overestimate of a norm counts as zero if, relative to the loads, it is below this value. The value is the tolerance of the
linear programs."""
EDGE = 0.05
"""Least distance of a cut from the sides of a cell, relative to the cell's opening. A cell whose cut would be nearer to a side is
halved instead."""


@dataclass(frozen=True)
class Found:
    """The result of a minimisation.

    Attributes:
        value: attained value; infinite if no admissible state was found.
        bound: certified lower bound.
        X: state that attains the value; None if no admissible state was found.
        cells: number of examined cells.
        endless: whether the value is unbounded below, along X.
    """

    value: float
    bound: float
    X: np.ndarray | None
    cells: int
    endless: bool = False

    @property
    def gap(self) -> float:
        """Distance between the value and the bound."""
        return max(0.0, self.value - self.bound)


class Search:
    """One search. budget: its cost limits; floor: known lower bound of the value; root: cones that contain all admissible
    vectors."""

    def __init__(self, program: Program, budget: SearchBudget, floor: float = -np.inf, root: Cell | None = None):
        self.root = root or {}
        self.program, self.budget, self.floor = program, budget, floor
        self.linear = Relaxation(program, budget.is_over)
        self.concave = program.concave()
        self.value, self.left = np.inf, np.inf
        self.X: np.ndarray | None = None
        self.count = itertools.count()
        self.heap: list[tuple[float, int, Cell, Answer]] = []
        self.cells = 0

    def run(self) -> Found:
        """Search until the gap is closed, or the limit of cells or time is reached."""
        self.budget.begin()
        if self.budget.is_over():
            self.budget.short += 1
            return Found(np.inf, self.floor, None, 0)
        self._visit(self.root, self.floor)
        while self.heap and self.cells < self.budget.cells and not self._endless():
            if self.heap[0][0] >= self.value - self._close():
                break
            if self.budget.is_over():
                self.budget.short += 1
                break
            bound, _, cell, answer = heapq.heappop(self.heap)
            parts = self._parts(cell, answer)
            if not parts:
                self.left = min(self.left, bound)
            for part in parts:
                self._visit(part, bound)
        lowest = self.heap[0][0] if self.heap else self.value
        return Found(self.value, min(lowest, self.left, self.value), self.X, self.cells, self._endless())

    def _close(self) -> float:
        return CLOSE * max(1.0, abs(self.value)) if np.isfinite(self.value) else 0.0

    def _endless(self) -> bool:
        return self.program.normal is None and self.X is not None and float(np.abs(self.X[:-1]).max(initial=0.0)) >= LIMIT

    def _visit(self, cell: Cell, bound: float) -> None:
        """Solve the relaxation of a cell, improve the best state, and queue the cell if it may contain a lower value."""
        self.cells += 1
        answer = self.linear.solve(cell)
        if answer is None:
            return
        low = max(bound, answer.value)
        if low >= self.value - self._close():
            return
        self._attain(answer.X)
        lowest = min(low, self.heap[0][0]) if self.heap else low
        if lowest < self.value - self._close() and (self.cells < 8 or self.cells % 8 == 0 or not np.isfinite(self.value)):
            climbed = self.linear.climb(answer.X, lowest, self._close())
            if climbed is not None:
                self._attain(climbed)
        if low < self.value - self._close():
            heapq.heappush(self.heap, (low, next(self.count), cell, answer))

    def _attain(self, X: np.ndarray) -> None:
        at = self.program.scaled(X)
        if at is None or self.program.violation(at) > FEASIBLE:
            return
        value = self.program.objective.value(at, self.program.norms(at))
        if value < self.value:
            self.value, self.X = value, at

    def _parts(self, cell: Cell, answer: Answer) -> list[Cell]:
        """The parts of a cell, which is cut where its relaxation is worst. If only tangents are missing, returns the cell itself:
        the next visit adds the tangents. Returns [] if the relaxation is exact."""
        j = self._worst(cell, answer)
        if j is None:
            return [cell] if len(self.linear.missing(answer)) else []
        v = self.program.terms[j] @ answer.X
        cones = _first(len(v)) if j not in cell else _cut(cell[j], v)
        return [{**cell, j: G} for G in cones]

    def _worst(self, cell: Cell, answer: Answer) -> int | None:
        """The term whose cone is cut: a term whose sense of friction is still open, or else the term whose overestimate has the
        largest effect. None if the relaxation is exact."""
        for row in self.program.rows:
            if row.when is not None and row.when[0] not in cell:
                return row.when[0]
        over = [self._excess(j, answer) for j in range(len(self.program.terms))]
        for a in self.program.across:
            f, m = self.program.terms[a.force] @ answer.X, self.program.terms[a.moment] @ answer.X
            over[a.force] = max(over[a.force], abs(float(f @ m)) / max(float(np.linalg.norm(f)), 1e-12))
        j = int(np.argmax(over)) if over else 0
        return j if over and over[j] > EXACT else None

    def _excess(self, j: int, answer: Answer) -> float:
        return self.concave[j] * max(0.0, answer.t[j] - float(np.linalg.norm(self.program.terms[j] @ answer.X)))


def _first(k: int) -> list[np.ndarray]:
    """Cones that cover all directions of a vector with k components."""
    if k == 1:
        return [np.array([[1.0]]), np.array([[-1.0]])]
    if k == 2:
        corners = [np.array([np.cos(a), np.sin(a)]) for a in (0.5, 0.5 + 2 * np.pi / 3, 0.5 + 4 * np.pi / 3)]
        return [np.column_stack([corners[i], corners[(i + 1) % 3]]) for i in range(3)]
    return [np.diag(s) for s in itertools.product((1.0, -1.0), repeat=k)]


def _cut(G: np.ndarray, v: np.ndarray) -> list[np.ndarray]:
    """The two parts of a cone. A cone of two components is cut through v, if v is well inside the cone. Any other cone is cut
    through the middle of its widest side."""
    k = len(v)
    if k == 1:
        return []
    pairs = list(itertools.combinations(range(k), 2))

    def product(pair: tuple[int, int]) -> float:
        return float(G[:, pair[0]] @ G[:, pair[1]])

    a, b = min(pairs, key=product)
    middle = G[:, a] + G[:, b]
    if k == 2:
        part = np.linalg.solve(G, v)
        share = part[0] / part.sum() if part.sum() > 0.0 else 0.5
        if EDGE < share < 1.0 - EDGE:
            middle = v
    middle = middle / np.linalg.norm(middle)
    halves = []
    for kept in (a, b):
        half = G.copy()
        half[:, b if kept == a else a] = middle
        halves.append(half)
    return halves


def minimise(program: Program, budget: SearchBudget, floor: float = -np.inf, root: Cell | None = None) -> Found:
    """The minimum of a program. Arguments as for ``Search``."""
    return Search(program, budget, floor, root).run() if program.width > 1 else _only_state(program)


def _only_state(program: Program) -> Found:
    """The value at the only state of equilibrium, for a program without open directions."""
    X = program.scaled(np.ones(1))
    if X is None or program.violation(X) > FEASIBLE:
        return Found(np.inf, np.inf, None, 1)
    value = program.objective.value(X, program.norms(X))
    return Found(value, value, X, 1)
