"""Order of a set of weights, from the order conditions of rooted trees (Hairer, Nørsett, Wanner, "Solving Ordinary Differential
Equations I", II.2). For Rosenbrock methods see Hairer, Wanner II, IV.7.

A tree is represented by the tuple of its subtrees. Let Φ be the elementary weights of the stages, and θ the part of the step over
which the weights w integrate. The weights have order p if w·Φ(t) = θ^|t|/γ(t) for every tree t of at most p nodes.

The module does not use NumPy, because names of methods are also needed where NumPy is not installed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from itertools import combinations_with_replacement

Tree = tuple["Tree", ...]
Matrix = Sequence[Sequence[float]]
MOST = 9
"""Largest order tested."""
ROUND_OFF = 1e-12
"""Largest relative defect of an order condition that counts as zero, because coefficients have 16 digits."""


@lru_cache(maxsize=MOST + 1)
def trees(nodes: int) -> tuple[Tree, ...]:
    """All rooted trees with this number of nodes."""
    return tuple(_forests(nodes - 1, nodes - 1))


def _forests(nodes: int, largest: int) -> list[Tree]:
    """All multisets of trees with ``nodes`` nodes in total and at most ``largest`` nodes per tree."""
    if nodes == 0:
        return [()]
    out: list[Tree] = []
    for size in range(min(nodes, largest), 0, -1):
        for count in range(1, nodes // size + 1):
            rest = _forests(nodes - count * size, size - 1)
            out += [(*group, *others) for group in combinations_with_replacement(trees(size), count) for others in rest]
    return out


@cache
def size(tree: Tree) -> int:
    """Number of nodes of a tree."""
    return 1 + sum(size(t) for t in tree)


@cache
def density(tree: Tree) -> int:
    """γ(t): the product of the sizes of all subtrees of t, including t."""
    out = size(tree)
    for t in tree:
        out *= density(t)
    return out


def carried(matrix: Matrix, values: Sequence[float]) -> list[float]:
    """Product of a matrix and a vector. Rows shorter than the vector are padded with zeros."""
    return [sum([a * v for a, v in zip(row, values, strict=False) if a]) for row in matrix]


class Elementary:
    """Elementary weights Φ(t) of a method, one number per stage. The weights of a subtree are multiplied by a matrix: by ``single``
    if the subtree's parent has one branch, by ``several`` if it has more. For Runge–Kutta methods both matrices are A; for
    Rosenbrock methods they are β and α."""

    def __init__(self, single: Matrix, several: Matrix):
        self.single, self.several = single, several
        self.known: dict[Tree, list[float]] = {}

    def __call__(self, tree: Tree) -> list[float]:
        if tree not in self.known:
            out = [1.0] * len(self.single)
            for t in tree:
                out = [a * b for a, b in zip(out, carried(self.single if len(tree) == 1 else self.several, self(t)), strict=True)]
            self.known[tree] = out
        return self.known[tree]

    def defect(self, weights: Sequence[float], tree: Tree, part: float = 1.0, exact: bool = True) -> float:
        """Relative defect of a tree's order condition. If ``exact`` is false (error estimators), the weighted sum itself must
        vanish."""
        terms = [w * p for w, p in zip(weights, self(tree), strict=True)]
        wanted = part ** size(tree) / density(tree) if exact else 0.0
        return abs(math.fsum(terms) - wanted) / (sum(map(abs, terms)) + wanted + 1e-300)

    def order(self, weights: Callable[[float], Sequence[float]], parts: tuple[float, ...] = (1.0,), exact: bool = True) -> int:
        """The order of the weights ``weights(θ)``, checked at each θ in ``parts``."""
        at = [(x, weights(x)) for x in parts]
        for p in range(1, MOST + 1):
            if any(self.defect(w, t, x, exact) > ROUND_OFF for t in trees(p) for x, w in at):
                return p - 1
        return MOST


PARTS = (0.23, 0.5, 0.81, 1.0)
"""Parts θ of a step at which the order of a dense output is checked."""
