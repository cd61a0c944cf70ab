"""Elementary motions of a mechanism at rest. A motion is elementary if no other motion exists in which only some of its sliding
pairs slide (theory, "Bounds at rest").

Every motion is a sum of elementary motions whose pairs slide in the same sense. If friction allows a motion to begin, it also
allows one of these elementary motions to begin.
"""

from __future__ import annotations

import itertools

import numpy as np

from trunnion.analysis.static_bounds.equilibrium_equations import Statics
from trunnion.analysis.static_bounds.equilibrium_space import RANK
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact.static_friction_capacity import Pair

MOST = 400
"""Largest number of sets of resting pairs to try. If there are more sets, a note reports that motions may be missing."""


@dataclass(frozen=True)
class Motion:
    """A motion that may begin.

    Attributes:
        rates: rates of the tree's freedoms (nv × 1), scaled to a largest surface velocity of 1. A ball or shaft that may slide
            in k directions gives k columns (nv × k).
        slides: surface velocity of every pair, zero for a pair at rest. With k columns, the entries of ``slides`` are magnitudes
        only.
    """

    rates: np.ndarray
    slides: tuple[np.ndarray, ...]

    @property
    def directed(self) -> bool:
        """Whether the direction of the motion is unique."""
        return self.rates.shape[1] == 1

    @property
    def moving(self) -> tuple[int, ...]:
        """Indices of the pairs that slide."""
        return tuple(i for i, v in enumerate(self.slides) if np.abs(v).max(initial=0.0) > 0.0)


def motions(st: Statics, pairs: tuple[Pair, ...], freed: int | None = None) -> tuple[list[Motion], int, bool]:
    """(elementary motions, number of freedoms without friction, whether all elementary motions were found). Each motion stands for
    itself and its reverse.

    Drives are held, except the drive with the index ``freed``.
    """
    held = [row for k, row in enumerate(st.driven) if k != freed]
    closed = np.vstack([st.closure, *held]) if held else st.closure
    free = _null_space(closed, st.rates.shape[1])
    W = [_surface_velocities(st, p) @ free for p in pairs]
    every = np.vstack(W) if W else np.zeros((0, free.shape[1]))
    unheld = _null_space(every, free.shape[1])
    rest = np.linalg.qr(unheld, mode="complete")[0][:, unheld.shape[1] :]  # a basis of the motions that friction resists
    found: list[Motion] = []
    for tried, chosen in enumerate(_resting_sets(W, rest)):
        if tried >= MOST:
            return found, unheld.shape[1], False
        rows = np.vstack([W[i] @ rest for i in chosen]) if chosen else np.zeros((0, rest.shape[1]))
        null = rest @ _null_space(rows, rest.shape[1])
        if null.shape[1] and all(_blocks_all(w, null) for w in W):
            _add(found, free @ null, [w @ null for w in W])
    return found, unheld.shape[1], True


def _resting_sets(W: list[np.ndarray], rest: np.ndarray) -> itertools.chain[tuple[int, ...]]:
    """Sets of resting pairs for which a single motion may remain possible. A set has fewer pairs than there are freedoms."""
    return itertools.chain.from_iterable(itertools.combinations(range(len(W)), k) for k in range(max(rest.shape[1], 1)))


def _blocks_all(w: np.ndarray, null: np.ndarray) -> bool:
    """Whether a pair rests in all motions of ``null``, or would block all of them if the pair were held."""
    left = w @ null
    moves = np.abs(left).max(initial=0.0) > RANK * max(float(np.abs(w).max(initial=0.0)), 1e-300)
    return not moves or np.linalg.matrix_rank(left, tol=RANK * float(np.linalg.norm(left))) == null.shape[1]


def _add(found: list[Motion], rates: np.ndarray, every: list[np.ndarray]) -> None:
    """Append a motion, if it is new. every: for each pair, the pair's rates in each direction of the motion (k × directions)."""
    slides = [v[:, 0] if v.shape[1] == 1 else np.linalg.norm(v, axis=1) for v in every]
    size = max(float(np.abs(v).max(initial=0.0)) for v in slides)
    clean = tuple(np.where(np.abs(v) > RANK * size, v / size, 0.0) for v in slides)
    for m in found:
        if all(np.allclose(a, b, atol=1e-9) or np.allclose(a, -b, atol=1e-9) for a, b in zip(clean, m.slides, strict=True)):
            return
    made = Motion(rates / size, clean)
    if not any(set(m.moving) < set(made.moving) for m in found):
        found.append(made)


def _surface_velocities(st: Statics, p: Pair) -> np.ndarray:
    """Jacobian of the pair's surface velocities along its friction components by the rates of the tree (k × nv)."""
    j = st.joint(p.joint)
    rows = st.rates[[j.element.rate0 + j.rubs.eta.index(eta) for eta in p.eta]]
    return np.linalg.inv(p.friction) @ rows


def _null_space(rows: np.ndarray, n: int) -> np.ndarray:
    """A basis of the null space of the rows (n × d). Each row is first scaled to its largest entry."""
    if not len(rows):
        return np.eye(n)
    scale = np.abs(rows).max(axis=1, initial=0.0)
    rows = rows[scale > 1e-12] / scale[scale > 1e-12, None]
    if not len(rows):
        return np.eye(n)
    _, sizes, Vt = np.linalg.svd(rows)
    return Vt[int((sizes > RANK * sizes.max(initial=0.0)).sum()) :].T
