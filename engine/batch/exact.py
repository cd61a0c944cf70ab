"""Sums of doubles without rounding, which are the same however what is added up is cut into parts.

A sum is an expansion: doubles of which the first is the sum, correctly rounded, the next what that left out, and so on until
nothing is left (Shewchuk 1997; ``math.fsum`` has each). It is as unique as the sum itself, and sums of expansions are exact again.
An array of sums has one axis more, the last, for the numbers of each, with zeros where one has fewer.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import chain
from math import fsum, prod

import numpy as np

SPLIT = 134217729.0
"""2²⁷ + 1: cuts a double into halves whose products are exact (Dekker 1971)."""
LARGEST = 1e140
"""No number beyond this is added up: its square, halved and put together, would not be a double."""


def expansion(values: Sequence[float]) -> list[float]:
    """The sum of numbers as it is."""
    found: list[float] = []
    while (left := fsum(chain(values, (-x for x in found)))) != 0.0:
        found.append(left)
    return found


def sums(columns: np.ndarray) -> np.ndarray:
    """The sums of the columns of an array (n × m), as an array (m × numbers). Of all numbers of a column first those bits are added
    that have room in a double with the carries of n numbers, then those below, until none is left (Rump, Ogita, Oishi 2008)."""
    parts, left, carries = [np.zeros(columns.shape[1])], columns, len(columns).bit_length() + 1
    while (top := np.abs(left).max(axis=0, initial=0.0)).any():
        grain = np.ldexp(1.5, np.frexp(top)[1] + carries)
        bits = (left + grain) - grain
        parts.append(bits.sum(axis=0))
        left = left - bits
    return padded([expansion(some) for some in np.transpose(parts).tolist()])


def padded(expansions: Sequence[Sequence[float]]) -> np.ndarray:
    """Expansions as an array (m × numbers)."""
    out = np.zeros((len(expansions), max(map(len, expansions), default=0)))
    for row, numbers in zip(out, expansions, strict=True):
        row[: len(numbers)] = numbers
    return out


def added(arrays: Iterable[np.ndarray]) -> np.ndarray:
    """The sums of arrays of sums, one by one; as unique as they are."""
    whole = np.concatenate(list(arrays), axis=-1)
    flat = padded([expansion(numbers) for numbers in _flat(whole).tolist()])
    return flat.reshape(*whole.shape[:-1], flat.shape[-1])


def _flat(array: np.ndarray) -> np.ndarray:
    return array.reshape(prod(array.shape[:-1]), array.shape[-1])


def products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products of numbers (n × m) and what rounding took from them (n × m), stacked (2n × m): their sum is exact, but for what lies
    below 10⁻²⁹⁰."""
    p = a * b
    (ah, al), (bh, bl) = _halves(a), _halves(b)
    return np.concatenate([p, ((ah * bh - p) + ah * bl + al * bh) + al * bl])


def _halves(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    high = SPLIT * x - (SPLIT * x - x)
    return high, x - high


def fractions(array: np.ndarray) -> np.ndarray:
    """Sums as fractions (an array of objects)."""
    out = np.empty(array.shape[:-1], object)
    flat = out.reshape(-1)
    for i, numbers in enumerate(_flat(array).tolist()):
        flat[i] = sum(map(Fraction, numbers), Fraction())
    return out
