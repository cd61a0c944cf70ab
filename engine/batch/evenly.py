"""Numbers in [0, 1) for samples, a row for each case and a column for each varied number: by chance, one in every strip, or Sobol's
points; and pairs of samples crossed as Saltelli does, of which Sobol indices are made.

All follow from the seed by PCG64 and by integer arithmetic, so they are the same everywhere. Sobol's points come from SciPy as he
has them; they are scrambled here (a random triangular matrix of bits and a shift for each number: Matoušek 1998), so that no case
lies at an end and the seed decides.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil

import numpy as np

from engine.basics.extras import brought

REPLICATES = 16
"""Scrambles of which a crossed sample is made, by turns: how its results differ between them is how well they are known."""
BITS = 30
MOST_DIMENSIONS = 21_201
"""For so many numbers Sobol's points are tabulated."""


def width(method: str, paths: int) -> int:
    """How many cases stand for one point of a sample."""
    return 2 * paths + 2 if method == "saltelli" else 1


def latin(count: int, axes: int, seed: int, strips: bool = True) -> np.ndarray:
    """count × axes, one case in each of ``count`` strips of every axis; without strips, each by itself."""
    out = np.empty((count, axes))
    for k in range(axes):
        generator = np.random.Generator(np.random.PCG64([seed, k]))
        strip = generator.permutation(count) if strips else None
        inside = generator.random(count)
        out[:, k] = inside if strip is None else (strip + inside) / count
    return out


def sobol(count: int, axes: int, seed: int, replicate: int = 0) -> np.ndarray:
    """The first ``count`` of Sobol's points, scrambled (count × axes)."""
    qmc = brought("scipy.stats", "analysis", "a Sobol sample").qmc
    whole = 1 << max(0, (count - 1).bit_length())
    plain = qmc.Sobol(axes, scramble=False, bits=BITS).random(whole)[:count]
    bits = np.rint(plain * (1 << BITS)).astype(np.uint64)
    out = np.empty((count, axes))
    for k in range(axes):
        generator = np.random.Generator(np.random.PCG64([seed, k, replicate]))
        out[:, k] = _scrambled(bits[:, k], generator)
    return out


def _scrambled(bits: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Numbers in (0, 1) of integers of BITS bits: a random lower triangular matrix of bits with ones on its diagonal, a shift, and
    the digits below by chance."""
    drawn = generator.integers(0, 1 << BITS, BITS, np.uint64)
    out = np.full(len(bits), generator.integers(0, 1 << BITS, dtype=np.uint64))
    for j in range(BITS):  # the bit of weight 2^(BITS - 1 - j) acts on itself and on those below it
        at = np.uint64(BITS - 1 - j)
        column = (drawn[j] & ((np.uint64(1) << at) - np.uint64(1))) | (np.uint64(1) << at)
        out ^= ((bits >> at) & np.uint64(1)) * column
    return (out + generator.random(len(bits))) / (1 << BITS)


@lru_cache(maxsize=4)
def points(count: int, axes: int, seed: int, method: str) -> np.ndarray:
    """Numbers in [0, 1), one for each case and varied path. count: points; a crossed sample has ``width`` cases for each."""
    if method == "saltelli":
        return _crossed(count, axes, seed)
    return sobol(count, axes, seed) if method == "sobol" else latin(count, axes, seed, method == "latin")


def _crossed(count: int, axes: int, seed: int) -> np.ndarray:
    """Two samples A and B, and for each point its rows of A; of A with one number from B, for each number; of B with one number
    from A; of B. Point k is of replicate k mod REPLICATES."""
    each = ceil(count / REPLICATES)
    both = np.stack([sobol(each, 2 * axes, seed, r) for r in range(REPLICATES)], axis=1).reshape(-1, 2 * axes)[:count]
    a, b = both[:, :axes], both[:, axes:]
    out = np.empty((count, 2 * axes + 2, axes))
    out[:, : axes + 1], out[:, axes + 1 :] = a[:, None], b[:, None]
    for i in range(axes):
        out[:, 1 + i, i], out[:, axes + 1 + i, i] = b[:, i], a[:, i]
    return out.reshape(-1, axes)
