"""Before a search: how large norms can be and how far vectors can turn, by linear programs over all admissible states at once.

Loads decide roughly where reactions go; what friction and self-stress leave open turns them by a few degrees. Every search of these
states then begins with narrow cells.
"""

from __future__ import annotations

import numpy as np

from engine.bounds.effort import Effort
from engine.bounds.program import Program, Row
from engine.bounds.relaxed import Cell, Relaxation

CAP = 1.0 + 1e-9
"""Room left above a largest value that a linear program has found: its tolerance, ten times."""
NARROW = 1e-6
"""Least opening of a cone, rad: its relaxation is exact to its square, and narrower ones are ill conditioned."""
ROUNDS = 4
"""Cones narrow each other; after so many rounds what is gained is less than one cut of a cell gains."""


def capped(program: Program, effort: Effort) -> Program:
    """The program with the largest value that each norm which helps when large may have by its other rows alone, so that its
    relaxations have an end before any cell is cut. Where the time is spent it has those that were found."""
    rows = []
    for j, helps in enumerate(program.concave()):
        if helps == 0.0 or effort.over():
            continue
        square = 0.0
        for V in program.terms[j]:
            ends = [Relaxation(program.asking(Row(s * V)), effort.over).solve({}) for s in (1.0, -1.0)]
            square += max((abs(e.value) for e in ends if e is not None), default=0.0) ** 2
        linear = np.zeros(program.width)
        linear[-1] = -float(np.sqrt(square)) * CAP
        rows.append(Row(linear, {j: 1.0}))
    return program.asking(program.objective, tuple(rows))


def first_cell(program: Program, X: np.ndarray, effort: Effort) -> Cell:
    """Cones in which vectors lie in every state of the program; X is one of them."""
    cell: Cell = {}
    for _ in range(ROUNDS):
        before = {j: G.copy() for j, G in cell.items()}
        for j, helps in enumerate(program.concave()):
            if helps > 0.0 and not effort.over():
                _narrow(program, j, program.terms[j] @ X, cell, effort)
        if all(j in before and np.abs(before[j] - G).max() < 0.1 * _opening(G) for j, G in cell.items()):
            break
    return cell


def _narrow(program: Program, j: int, v: np.ndarray, cell: Cell, effort: Effort) -> None:
    """Put the cone of term j into the cell, or a narrower one, where its vector cannot turn far."""
    size, V = float(np.linalg.norm(v)), program.terms[j]
    if size < NARROW:
        return
    u = v / size
    if not _ahead(program, u @ V, cell, effort) or effort.over():
        return
    if len(v) == 1:
        cell[j] = u[None, :]
        return
    across = np.linalg.svd(u[None, :])[2][1:]
    spans = []
    for w in across:
        asked = [program.asking(Row(s * w @ V), normal=Row(u @ V)) for s in (1.0, -1.0)]
        ends = [Relaxation(p, effort.over).solve(cell) for p in asked]
        if ends[0] is None or ends[1] is None:
            return
        spans.append((ends[0].value - NARROW, -ends[1].value + NARROW))
    sides = [u + corner @ across for corner in _corners(spans)]
    cell[j] = np.column_stack([s / np.linalg.norm(s) for s in sides])


def _corners(spans: list[tuple[float, float]]) -> list[np.ndarray]:
    """Corners of a simplex that holds the box of these spans: its ends of one, of two a triangle twice as long either way."""
    low, size = np.array([a for a, _ in spans]), np.array([b - a for a, b in spans]) * len(spans)
    return [low, *(low + row for row in np.diag(size))]


def _ahead(program: Program, row: np.ndarray, cell: Cell, effort: Effort) -> bool:
    """Whether a linear function is positive in every state, as far as one linear program tells."""
    least = Relaxation(program.asking(Row(row)), effort.over).solve(cell)
    return least is not None and least.value >= NARROW


def _opening(G: np.ndarray) -> float:
    return float(np.linalg.norm(G[:, 0] - G[:, -1]))
