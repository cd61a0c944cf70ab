"""Numbers in [0, 1) for samples, a row for each case and a column for each varied number.

Samples are random, Latin, Sobol, or pairs of Sobol samples crossed as by Saltelli for Sobol indices. All follow from the seed by
PCG64 and integer arithmetic, and are the same on every machine. Sobol directions are those of SciPy. Points are scrambled by a
random triangular bit matrix and a shift for each number (Matoušek 1998).
"""

from __future__ import annotations

import warnings
from functools import lru_cache
from math import ceil
from typing import Any

import numpy as np

from trunnion.basics.optional_packages import brought

REPLICATES = 16
"""Scrambles of a crossed sample, in turns; the differences of their results give intervals."""
BITS = 30
LARGE = 4_000_000
"""Cases above which a sample is never made as a whole. The strips of a Latin sample then follow from another permutation."""
TOGETHER = 10
"""Low bits of the points' numbers whose sums are cached."""


def width(method: str, paths: int) -> int:
    """Number of cases for each point of a sample."""
    return 2 * paths + 2 if method == "saltelli" else 1


def latin(count: int, axes: int, seed: int, strips: bool = True) -> np.ndarray:
    """A sample (count × axes) with one case in each of ``count`` strips of every axis; without strips, independent cases."""
    out = np.empty((count, axes))
    for k in range(axes):
        generator = np.random.Generator(np.random.PCG64([seed, k]))
        strip = generator.permutation(count) if strips else None
        inside = generator.random(count)
        out[:, k] = inside if strip is None else (strip + inside) / count
    return out


def strips(count: int, seed: int, axis: int, cases: np.ndarray) -> np.ndarray:
    """Strips of these cases (n) of a large Latin sample, by a permutation of ``count`` numbers without a table.

    The permutation is a Feistel network of six rounds over the next power of four, repeated until its value is below ``count``."""
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
    """The finaliser of SplitMix64 (Steele, Lea, Flood 2014): each of 64 bits depends on all."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def sobol(axes: int, seed: int, start: int, stop: int) -> np.ndarray:
    """Scrambled Sobol points start … stop − 1 (n × axes)."""
    return _replicate(_bits(axes, start, stop), seed, start, 0)


def _replicate(bits: np.ndarray, seed: int, start: int, replicate: int) -> np.ndarray:
    """A scramble of points (n × axes). start: number of the first point."""
    generators = [np.random.Generator(np.random.PCG64([seed, k, replicate])) for k in range(bits.shape[1])]
    return np.column_stack([_scrambled(bits[:, k], g, start) for k, g in enumerate(generators)])


def _bits(axes: int, start: int, stop: int) -> np.ndarray:
    """Sobol points start … stop − 1 as integers of BITS bits (n × axes). ValueError beyond the last point.

    Point n is the exclusive or of the directions in the Gray code of n, hence of the points of its high and of its low bits."""
    if stop > 1 << BITS:
        raise ValueError(f"Sobol's sequence has 2^{BITS} points here")
    numbers = np.arange(start, stop)
    low, first = _first_points(axes), start >> TOGETHER
    high = _summed(_directions(axes), np.arange(first, (max(start, stop - 1) >> TOGETHER) + 1) << TOGETHER)
    return high[(numbers >> TOGETHER) - first] ^ low[numbers & ((1 << TOGETHER) - 1)]


def _summed(directions: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Sobol points of these numbers (n) from directions (axes × bits)."""
    gray = (numbers ^ (numbers >> 1)).astype(np.uint64)
    out = np.zeros((len(numbers), len(directions)), np.uint64)
    for j, direction in enumerate(directions.T):
        out ^= ((gray >> np.uint64(j)) & np.uint64(1))[:, None] * direction
    return out


@lru_cache(maxsize=16)
def _first_points(axes: int) -> np.ndarray:
    """The points of the numbers below 2^TOGETHER."""
    return _summed(_directions(axes), np.arange(1 << TOGETHER))


@lru_cache(maxsize=16)
def _directions(axes: int) -> np.ndarray:
    """The directions (axes × BITS) of Joe and Kuo in SciPy."""
    sequence = brought("scipy.stats", "analysis", "a Sobol sample").qmc.Sobol(axes, scramble=False, bits=BITS)
    private = getattr(sequence, "_sv", None)
    return directions_from_points(sequence, BITS) if private is None else np.asarray(private).astype(np.uint64)


def directions_from_points(sequence: Any, bits: int) -> np.ndarray:
    """The directions of a new sequence from its points: point 2ᵏ − 1 has the Gray code 2ᵏ⁻¹. Takes seconds."""
    out = []
    for k in range(bits):
        sequence.fast_forward((2 << k) - 1 - sequence.num_generated)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # about numbers of points other than powers of 2
            out.append(np.rint(sequence.random(1)[0] * (1 << bits)))
    return np.column_stack(out).astype(np.uint64)


def _scrambled(bits: np.ndarray, generator: np.random.Generator, start: int) -> np.ndarray:
    """Numbers in (0, 1) from integers of BITS bits (n): a random lower triangular bit matrix, a shift, and random lower digits.

    start: number of the first point."""
    drawn = generator.integers(0, 1 << BITS, BITS, np.uint64)
    out = np.full(len(bits), generator.integers(0, 1 << BITS, dtype=np.uint64))
    for j in range(BITS):  # the bit of weight 2^(BITS - 1 - j) acts on itself and on lower bits
        at = np.uint64(BITS - 1 - j)
        column = (drawn[j] & ((np.uint64(1) << at) - np.uint64(1))) | (np.uint64(1) << at)
        out ^= ((bits >> at) & np.uint64(1)) * column
    generator.bit_generator.advance(start)  # type: ignore[attr-defined]  # a number takes one draw
    return (out + generator.random(len(bits))) / (1 << BITS)


def points(count: int, axes: int, seed: int, method: str, start: int, stop: int) -> np.ndarray:
    """Numbers in [0, 1) of cases start … stop − 1 (n × axes). count: points of the sample, with ``width`` cases each.

    Of a sample with more than LARGE cases only these rows are made."""
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
    """Rows of a large Latin or random sample; random rows equal those of the whole sample."""
    out = np.empty((stop - start, axes))
    for k in range(axes):
        generator = np.random.Generator(np.random.PCG64([seed, k]))
        generator.bit_generator.advance(start)  # type: ignore[attr-defined]
        inside = generator.random(stop - start)
        out[:, k] = (strips(count, seed, k, np.arange(start, stop)) + inside) / count if method == "latin" else inside
    return out


def _crossed(count: int, axes: int, seed: int, start: int, stop: int) -> np.ndarray:
    """Rows start … stop − 1 of a crossed sample: for each point the row of A, A with each number from B, B with each number from A,
    and B. Point k belongs to replicate k mod REPLICATES."""
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
