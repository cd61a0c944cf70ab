"""Bounds of norms and directions, computed before a search by linear programs over all admissible states.

The loads roughly determine the reactions. Friction and self-stress change the directions of the reactions by a few degrees only.
Searches therefore begin with narrow cells.
"""

from __future__ import annotations

import numpy as np

from trunnion.analysis.static_bounds.linear_relaxation import Cell, Relaxation
from trunnion.analysis.static_bounds.search_budget import SearchBudget
from trunnion.analysis.static_bounds.sum_of_norms_program import Program, Row

CAP = 1.0 + 1e-9
"""The largest value that a linear program finds is multiplied by this factor, to be certain. The excess over 1 is ten times the
tolerance of the program."""
NARROW = 1e-6
"""Least opening of a cone, rad. The error of the relaxation is the square of the opening. Narrower cones are ill conditioned."""
FORWARD = 1e-3
"""Least component, relative to the loads, of a term's vectors along the axis of its cone. The linear programs give the cone's
sides with an error of 1e-10 over this component; ``NARROW`` exceeds this error."""
ROUNDS = 4
"""Largest number of rounds in which cones narrow each other. A further round would gain less than one cut of a cell."""


def limit_norms(program: Program, budget: SearchBudget) -> Program:
    """The program, with an upper bound added for each norm whose overestimate would relax the program. The relaxations of the
    returned program are bounded. When the time is used up, only the bounds found so far are added.
    """
    rows, relaxation = [], Relaxation(program, budget.is_over)
    for j, helps in enumerate(program.concave()):
        if helps == 0.0 or budget.is_over():
            continue
        ends = list(relaxation.solutions({}, [Row(s * v) for v in program.terms[j] for s in (1.0, -1.0)]))
        pairs = zip(ends[::2], ends[1::2], strict=True)
        square = sum(max((abs(e.value) for e in both if e is not None), default=0.0) ** 2 for both in pairs)
        linear = np.zeros(program.width)
        linear[-1] = -float(np.sqrt(square)) * CAP
        rows.append(Row(linear, {j: 1.0}))
    return program.with_objective(program.objective, tuple(rows))


def first_cell(program: Program, X: np.ndarray, budget: SearchBudget) -> Cell:
    """Cones that contain the vectors of the terms in every state of the program. X: one state of the program."""
    cell: Cell = {}
    relaxation = Relaxation(program, budget.is_over)
    for _ in range(ROUNDS):
        before = {j: G.copy() for j, G in cell.items()}
        for j, helps in enumerate(program.concave()):
            if helps > 0.0 and not budget.is_over():
                _narrow(relaxation, j, program.terms[j] @ X, cell)
        if all(j in before and np.abs(before[j] - G).max() < 0.1 * _opening(G) for j, G in cell.items()):
            break
    return cell


def _narrow(relaxation: Relaxation, j: int, v: np.ndarray, cell: Cell) -> None:
    """Add or narrow the cone of term j in the cell, if the vector of the term stays within a half space. The homogeneous programs
    scale states by factors of at most 1, so that no state exceeds the limit ``FAR``."""
    size, V = float(np.linalg.norm(v)), relaxation.program.terms[j]
    if size < NARROW:
        return
    u = v / size
    least = next(relaxation.solutions(cell, [Row(u @ V)]))
    if least is None or least.value < FORWARD or relaxation.is_over():
        return
    if len(v) == 1:
        cell[j] = u[None, :]
        return
    across = np.linalg.svd(u[None, :])[2][1:]
    ends = []
    for end in relaxation.solutions(cell, [Row(s * w @ V) for w in across for s in (1.0, -1.0)], Row(u @ V / least.value)):
        if end is None:
            return
        ends.append(end.value / least.value - NARROW)
    sides = [u + corner @ across for corner in _corners([(a, -b) for a, b in zip(ends[::2], ends[1::2], strict=True)])]
    cell[j] = np.column_stack([s / np.linalg.norm(s) for s in sides])


def _corners(spans: list[tuple[float, float]]) -> list[np.ndarray]:
    """Corners of a simplex that contains the box of these spans. For one span, the corners are its two ends. For two spans, the
    corners form a triangle with twice the sides of the box."""
    low, size = np.array([a for a, _ in spans]), np.array([b - a for a, b in spans]) * len(spans)
    return [low, *(low + row for row in np.diag(size))]


def _opening(G: np.ndarray) -> float:
    return float(np.linalg.norm(G[:, 0] - G[:, -1]))
