"""Numbers in [0, 1) for samples, a row for each case and a column for each varied number: by chance, one in every strip, or Sobol's
points; and pairs of samples crossed as Saltelli does, of which Sobol indices are made.

All follow from the seed by PCG64 and by integer arithmetic, so they are the same everywhere. Sobol's points are SciPy's, from the
directions he has; they are scrambled here (a random triangular matrix of bits and a shift for each number: Matoušek 1998), so that
no case lies at an end and the seed decides.
"""

from __future__ import annotations

import warnings
from functools import lru_cache
from math import ceil
from typing import Any

import numpy as np

from engine.basics.extras import brought

REPLICATES = 16
"""Scrambles of which a crossed sample is made, by turns: how its results differ between them is how well they are known."""
BITS = 30
LARGE = 4_000_000
"""Numbers of cases above which a sample is never made whole (a Latin one of so many has other strips than a smaller one would)."""
MOST_DIMENSIONS = 21_201
"""For so many numbers Sobol's points are tabulated."""
TOGETHER = 10
"""Bits of the numbers of Sobol's points that are added up once for all."""


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


def strips(count: int, seed: int, axis: int, cases: np.ndarray) -> np.ndarray:
    """Strips of these cases (n) of a Latin sample too large to be shuffled: a permutation of ``count`` numbers of which each is had
    by itself, six rounds of a Feistel network over the next power of four, walked until it is back inside."""
    half = np.uint64(max(1, ((count - 1).bit_length() + 1) // 2))
    mask = (np.uint64(1) << half) - np.uint64(1)
    keys = np.random.Generator(np.random.PCG64([seed, axis, LARGE])).integers(0, 1 << 63, 6, np.uint64)
    out = cases.astype(np.uint64)
    outside = np.ones(len(out), bool)
    while outside.any():
        left, right = out[outside] >> half, out[outside] & mask
        for key in keys:
            left, right = right, left ^ (mixed(right + key) & mask)
        out[outside] = (left << half) | right
        outside = out >= count
    return out


def mixed(x: np.ndarray) -> np.ndarray:
    """Each of 64 bits follows from all (the finaliser of SplitMix64: Steele, Lea, Flood 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def sobol(axes: int, seed: int, start: int, stop: int) -> np.ndarray:
    """Sobol's points start … stop − 1, scrambled (n × axes)."""
    return _replicate(_bits(axes, start, stop), seed, start, 0)


def _replicate(bits: np.ndarray, seed: int, start: int, replicate: int) -> np.ndarray:
    """One scramble of points (n × axes) of which the first is point ``start``."""
    generators = [np.random.Generator(np.random.PCG64([seed, k, replicate])) for k in range(bits.shape[1])]
    return np.column_stack([_scrambled(bits[:, k], g, start) for k, g in enumerate(generators)])


def _bits(axes: int, start: int, stop: int) -> np.ndarray:
    """Sobol's points start … stop − 1, as integers of BITS bits (n × axes). Point n is the sum, bit by bit and without carries, of
    the directions that the Gray code of n names: so each is had by its number, and is the sum of those of its high and low bits."""
    if stop > 1 << BITS:
        raise ValueError(f"Sobol's sequence has 2^{BITS} points here")
    numbers = np.arange(start, stop)
    low, first = _first_points(axes), start >> TOGETHER
    high = _summed(_directions(axes), np.arange(first, (max(start, stop - 1) >> TOGETHER) + 1) << TOGETHER)
    return high[(numbers >> TOGETHER) - first] ^ low[numbers & ((1 << TOGETHER) - 1)]


def _summed(directions: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Sobol's points of these numbers (n), of directions (axes × bits)."""
    gray = (numbers ^ (numbers >> 1)).astype(np.uint64)
    out = np.zeros((len(numbers), len(directions)), np.uint64)
    for j, direction in enumerate(directions.T):
        out ^= ((gray >> np.uint64(j)) & np.uint64(1))[:, None] * direction
    return out


@lru_cache(maxsize=16)
def _first_points(axes: int) -> np.ndarray:
    """The points of the numbers whose higher bits are all zero."""
    return _summed(_directions(axes), np.arange(1 << TOGETHER))


@lru_cache(maxsize=16)
def _directions(axes: int) -> np.ndarray:
    """Sobol's directions (axes × BITS) of Joe and Kuo, as SciPy has them."""
    sequence = brought("scipy.stats", "analysis", "a Sobol sample").qmc.Sobol(axes, scramble=False, bits=BITS)
    told = getattr(sequence, "_sv", None)
    return walked(sequence, BITS) if told is None else np.asarray(told).astype(np.uint64)


def walked(sequence: Any, bits: int) -> np.ndarray:
    """The directions of a sequence at its start, from its points alone: point 2ᵏ − 1 has the Gray code 2ᵏ⁻¹. Takes seconds."""
    out = []
    for k in range(bits):
        sequence.fast_forward((2 << k) - 1 - sequence.num_generated)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of numbers that are no power of 2
            out.append(np.rint(sequence.random(1)[0] * (1 << bits)))
    return np.column_stack(out).astype(np.uint64)


def _scrambled(bits: np.ndarray, generator: np.random.Generator, start: int) -> np.ndarray:
    """Numbers in (0, 1) of integers of BITS bits, the first of which is that of point ``start``: a random lower triangular matrix
    of bits with ones on its diagonal, a shift, and the digits below by chance."""
    drawn = generator.integers(0, 1 << BITS, BITS, np.uint64)
    out = np.full(len(bits), generator.integers(0, 1 << BITS, dtype=np.uint64))
    for j in range(BITS):  # the bit of weight 2^(BITS - 1 - j) acts on itself and on those below it
        at = np.uint64(BITS - 1 - j)
        column = (drawn[j] & ((np.uint64(1) << at) - np.uint64(1))) | (np.uint64(1) << at)
        out ^= ((bits >> at) & np.uint64(1)) * column
    generator.bit_generator.advance(start)  # type: ignore[attr-defined]  # a number takes one draw
    return (out + generator.random(len(bits))) / (1 << BITS)


def points(count: int, axes: int, seed: int, method: str, start: int, stop: int) -> np.ndarray:
    """Numbers in [0, 1) of cases start … stop − 1, a row for each and a column for each varied path. count: points of the sample; a
    crossed one has ``width`` cases for each. Of a sample of more than LARGE no more than these are made."""
    if count * width(method, axes) <= LARGE:
        return _whole(count, axes, seed, method)[start:stop]
    if method == "saltelli":
        return _crossed(count, axes, seed, start, stop)
    return sobol(axes, seed, start, stop) if method == "sobol" else _large(count, axes, seed, method, start, stop)


@lru_cache(maxsize=4)
def _whole(count: int, axes: int, seed: int, method: str) -> np.ndarray:
    """All rows of a sample."""
    if method == "saltelli":
        return _crossed(count, axes, seed, 0, count * width(method, axes))
    return sobol(axes, seed, 0, count) if method == "sobol" else latin(count, axes, seed, method == "latin")


def _large(count: int, axes: int, seed: int, method: str, start: int, stop: int) -> np.ndarray:
    """Some rows of a Latin or random sample; random ones as they are in the whole."""
    out = np.empty((stop - start, axes))
    for k in range(axes):
        generator = np.random.Generator(np.random.PCG64([seed, k]))
        generator.bit_generator.advance(start)  # type: ignore[attr-defined]
        inside = generator.random(stop - start)
        out[:, k] = (strips(count, seed, k, np.arange(start, stop)) + inside) / count if method == "latin" else inside
    return out


def _crossed(count: int, axes: int, seed: int, start: int, stop: int) -> np.ndarray:
    """Rows start … stop − 1 of two samples A and B, and for each point its rows of A; of A with one number from B, for each number;
    of B with one number from A; of B. Point k is of replicate k mod REPLICATES."""
    wide = 2 * axes + 2
    low, high = start // wide, min(count, ceil(stop / wide))
    first, last = low // REPLICATES, ceil(high / REPLICATES)
    bits = _bits(2 * axes, first, last)
    both = np.stack([_replicate(bits, seed, first, r) for r in range(REPLICATES)], axis=1).reshape(-1, 2 * axes)
    both = both[low - first * REPLICATES : high - first * REPLICATES]
    a, b = both[:, :axes], both[:, axes:]
    out = np.empty((high - low, wide, axes))
    out[:, : axes + 1], out[:, axes + 1 :] = a[:, None], b[:, None]
    for i in range(axes):
        out[:, 1 + i, i], out[:, axes + 1 + i, i] = b[:, i], a[:, i]
    return out.reshape(-1, axes)[start - low * wide : stop - low * wide]
