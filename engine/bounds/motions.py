"""Which motions a mechanism at rest can begin: elementary ones, in which no fewer pairs slide (METHOD, "Bounds at rest").

Every motion is a sum of elementary ones whose pairs slide the same way, so that friction that lets the whole begin lets one of them
begin: those few stand for all.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from engine.bounds.space import RANK
from engine.bounds.statics import Statics
from engine.contact.resting import Pair

MOST = 400
"""Sets of pairs at rest that are tried for elementary motions; if there are more, a note says that motions may be missing."""


@dataclass(frozen=True)
class Motion:
    """A motion that may begin. rates of the tree's freedoms (nv × 1), the fastest surface 1; slides: for every pair its rates as
    surface velocities (zero where it rests). Where a ball or a shaft may begin to slide in several directions and no pair can rest
    in its stead, they are the columns of rates (nv × k), and slides says only which pairs slide."""

    rates: np.ndarray
    slides: tuple[np.ndarray, ...]

    @property
    def directed(self) -> bool:
        """Whether its direction is known."""
        return self.rates.shape[1] == 1

    @property
    def moving(self) -> tuple[int, ...]:
        """Indices of the pairs that slide."""
        return tuple(i for i, v in enumerate(self.slides) if np.abs(v).max(initial=0.0) > 0.0)


def motions(st: Statics, pairs: tuple[Pair, ...], freed: int | None = None) -> tuple[list[Motion], int, bool]:
    """(elementary motions, each once for both senses; how many freedoms no pair rubs against; whether all were found), drives held
    but for the one named."""
    held = [row for k, row in enumerate(st.driven) if k != freed]
    closed = np.vstack([st.closure, *held]) if held else st.closure
    free = _null(closed, st.rates.shape[1])
    W = [_sliding(st, p) @ free for p in pairs]
    every = np.vstack(W) if W else np.zeros((0, free.shape[1]))
    unheld = _null(every, free.shape[1])
    rest = np.linalg.qr(unheld, mode="complete")[0][:, unheld.shape[1] :]  # motions, apart from those that nothing holds
    found: list[Motion] = []
    for tried, chosen in enumerate(_sets(W, rest)):
        if tried >= MOST:
            return found, unheld.shape[1], False
        rows = np.vstack([W[i] @ rest for i in chosen]) if chosen else np.zeros((0, rest.shape[1]))
        null = rest @ _null(rows, rest.shape[1])
        if null.shape[1] and all(_stops(w, null) for w in W):
            _add(found, free @ null, [w @ null for w in W])
    return found, unheld.shape[1], True


def _sets(W: list[np.ndarray], rest: np.ndarray) -> itertools.chain[tuple[int, ...]]:
    """Sets of pairs whose rest may leave one motion: up to as many as there are freedoms, less one."""
    return itertools.chain.from_iterable(itertools.combinations(range(len(W)), k) for k in range(max(rest.shape[1], 1)))


def _stops(w: np.ndarray, null: np.ndarray) -> bool:
    """Whether a pair rests in these motions, or would stop all of them if it did."""
    left = w @ null
    moves = np.abs(left).max(initial=0.0) > RANK * max(float(np.abs(w).max(initial=0.0)), 1e-300)
    return not moves or np.linalg.matrix_rank(left, tol=RANK * float(np.linalg.norm(left))) == null.shape[1]


def _add(found: list[Motion], rates: np.ndarray, every: list[np.ndarray]) -> None:
    """Keep a motion that is not there yet. every: for each pair its rates in each of the motion's directions (k × directions)."""
    slides = [v[:, 0] if v.shape[1] == 1 else np.linalg.norm(v, axis=1) for v in every]
    size = max(float(np.abs(v).max(initial=0.0)) for v in slides)
    clean = tuple(np.where(np.abs(v) > RANK * size, v / size, 0.0) for v in slides)
    for m in found:
        if all(np.allclose(a, b, atol=1e-9) or np.allclose(a, -b, atol=1e-9) for a, b in zip(clean, m.slides, strict=True)):
            return
    made = Motion(rates / size, clean)
    if not any(set(m.moving) < set(made.moving) for m in found):
        found.append(made)


def _sliding(st: Statics, p: Pair) -> np.ndarray:
    """Surface velocities of a pair along its friction, by the tree's rates: what friction at the surface takes power by."""
    j = st.joint(p.joint)
    rows = st.rates[[j.element.rate0 + j.rubs.eta.index(eta) for eta in p.eta]]
    return np.linalg.inv(p.friction) @ rows


def _null(rows: np.ndarray, n: int) -> np.ndarray:
    """A basis of what the rows leave open, each row in its own scale."""
    if not len(rows):
        return np.eye(n)
    scale = np.abs(rows).max(axis=1, initial=0.0)
    rows = rows[scale > 1e-12] / scale[scale > 1e-12, None]
    if not len(rows):
        return np.eye(n)
    _, sizes, Vt = np.linalg.svd(rows)
    return Vt[int((sizes > RANK * sizes.max(initial=0.0)).sum()) :].T
