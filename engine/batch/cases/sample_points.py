"""Numbers in [0, 1) for samples, with a row for each case and a column for each varied number.

Samples are random, Latin, Sobol, or crossed pairs of Sobol samples (Saltelli) for Sobol indices. PCG64 and integer arithmetic
compute all samples from the seed. Therefore the samples are the same on every machine. The direction numbers of Sobol points come
from SciPy. For each column, a random triangular bit matrix and a random shift scramble the points (Matoušek 1998).
"""

from __future__ import annotations

import warnings
from functools import lru_cache
from math import ceil
from typing import Any

import numpy as np

from trunnion.basics.optional_packages import brought

REPLICATES = 16
"""Number of independent scrambles (replicates) of a crossed sample. Successive points belong to successive replicates. Confidence
intervals follow from the differences between the results of the replicates."""
BITS = 30
LARGE = 4_000_000
"""A sample with more cases than this is never held in memory as a whole. The strips of such a Latin sample follow from a
permutation that is computed case by case."""
TOGETHER = 10
"""Points whose index has at most this number of bits are stored in a table."""


def width(method: str, paths: int) -> int:
    """Number of cases for each point of a sample."""
    return 2 * paths + 2 if method == "saltelli" else 1


def latin(count: int, axes: int, seed: int, strips: bool = True) -> np.ndarray:
    """A Latin sample (count × axes), with one case in each of ``count`` strips of every axis. Without ``strips``, the cases are
    independent."""
    out = np.empty((count, axes))
    for k in range(axes):
        generator = np.random.Generator(np.random.PCG64([seed, k]))
        strip = generator.permutation(count) if strips else None
        inside = generator.random(count)
        out[:, k] = inside if strip is None else (strip + inside) / count
    return out


def strips(count: int, seed: int, axis: int, cases: np.ndarray) -> np.ndarray:
    """The strips of the cases (n) in a large Latin sample. The strips are a permutation of ``count`` numbers, computed without a
    table.

    The permutation is a Feistel network of six rounds over the next power of four. The network is applied repeatedly until its
    value is below ``count``.
    """
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
    """A hash of 64-bit integers: the finaliser of SplitMix64 (Steele, Lea, Flood 2014). Each bit of the result depends on all bits
    of x."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def sobol(axes: int, seed: int, start: int, stop: int) -> np.ndarray:
    """Scrambled Sobol points from start to stop − 1 (n × axes)."""
    return _replicate(_bits(axes, start, stop), seed, start, 0)


def _replicate(bits: np.ndarray, seed: int, start: int, replicate: int) -> np.ndarray:
    """One scramble of points (n × axes). start: index of the first point."""
    generators = [np.random.Generator(np.random.PCG64([seed, k, replicate])) for k in range(bits.shape[1])]
    return np.column_stack([_scrambled(bits[:, k], g, start) for k, g in enumerate(generators)])


def _bits(axes: int, start: int, stop: int) -> np.ndarray:
    """Sobol points from start to stop − 1 as integers of BITS bits (n × axes). ValueError beyond the last point.

    Point n is the exclusive or of the direction numbers that the bits of n's Gray code select. Therefore point n is also the
    exclusive or of two other points. The index of the first has the high bits of n. The index of the second has the low bits.
    """
    if stop > 1 << BITS:
        raise ValueError(f"Sobol's sequence has 2^{BITS} points here")
    numbers = np.arange(start, stop)
    low, first = _first_points(axes), start >> TOGETHER
    high = _summed(_directions(axes), np.arange(first, (max(start, stop - 1) >> TOGETHER) + 1) << TOGETHER)
    return high[(numbers >> TOGETHER) - first] ^ low[numbers & ((1 << TOGETHER) - 1)]


def _summed(directions: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """The Sobol points with the indices ``numbers`` (n), computed from direction numbers (axes × bits)."""
    gray = (numbers ^ (numbers >> 1)).astype(np.uint64)
    out = np.zeros((len(numbers), len(directions)), np.uint64)
    for j, direction in enumerate(directions.T):
        out ^= ((gray >> np.uint64(j)) & np.uint64(1))[:, None] * direction
    return out


@lru_cache(maxsize=16)
def _first_points(axes: int) -> np.ndarray:
    """The points with indices below 2^TOGETHER."""
    return _summed(_directions(axes), np.arange(1 << TOGETHER))


@lru_cache(maxsize=16)
def _directions(axes: int) -> np.ndarray:
    """The direction numbers (axes × BITS) of Joe and Kuo, from SciPy."""
    sequence = brought("scipy.stats", "analysis", "a Sobol sample").qmc.Sobol(axes, scramble=False, bits=BITS)
    private = getattr(sequence, "_sv", None)
    return directions_from_points(sequence, BITS) if private is None else np.asarray(private).astype(np.uint64)


def directions_from_points(sequence: Any, bits: int) -> np.ndarray:
    """The direction numbers of a new sequence, computed from its points. The Gray code of 2ᵏ − 1 is the single bit 2ᵏ⁻¹, so the
    point with this index is a direction number. The computation takes seconds."""
    out = []
    for k in range(bits):
        sequence.fast_forward((2 << k) - 1 - sequence.num_generated)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # SciPy would warn that the number of points is not a power of 2
            out.append(np.rint(sequence.random(1)[0] * (1 << bits)))
    return np.column_stack(out).astype(np.uint64)


def _scrambled(bits: np.ndarray, generator: np.random.Generator, start: int) -> np.ndarray:
    """Scramble integers of BITS bits (n) to numbers in (0, 1). The scramble consists of a random lower triangular bit matrix, a
    random shift and random lower digits.

    start: index of the first point.
    """
    drawn = generator.integers(0, 1 << BITS, BITS, np.uint64)
    out = np.full(len(bits), generator.integers(0, 1 << BITS, dtype=np.uint64))
    for j in range(BITS):  # the bit of weight 2^(BITS - 1 - j) affects only this bit and lower bits
        at = np.uint64(BITS - 1 - j)
        column = (drawn[j] & ((np.uint64(1) << at) - np.uint64(1))) | (np.uint64(1) << at)
        out ^= ((bits >> at) & np.uint64(1)) * column
    generator.bit_generator.advance(start)  # type: ignore[attr-defined]  # skip the draws of earlier numbers
    return (out + generator.random(len(bits))) / (1 << BITS)


def points(count: int, axes: int, seed: int, method: str, start: int, stop: int) -> np.ndarray:
    """Numbers in [0, 1) of cases start … stop − 1 (n × axes). count: number of points of the sample, with ``width`` cases each.

    If the sample has more than LARGE cases, only the requested rows are computed.
    """
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
    """Some rows of a large Latin or random sample. Random rows are equal to those rows of the whole sample."""
    out = np.empty((stop - start, axes))
    for k in range(axes):
        generator = np.random.Generator(np.random.PCG64([seed, k]))
        generator.bit_generator.advance(start)  # type: ignore[attr-defined]
        inside = generator.random(stop - start)
        out[:, k] = (strips(count, seed, k, np.arange(start, stop)) + inside) / count if method == "latin" else inside
    return out


def _crossed(count: int, axes: int, seed: int, start: int, stop: int) -> np.ndarray:
    """Rows start … stop − 1 of a crossed sample of the samples A and B. The rows of a point are, in this order: A; A with one
    number from B, for each number; B with one number from A, for each number; B.

    Point k belongs to replicate k mod REPLICATES.
    """
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
