"""Sums of doubles without rounding errors. Therefore they do not depend on how their terms are partitioned.

A sum is an expansion (Shewchuk 1997): its first double is the correctly rounded sum, and each further double is the correctly
rounded remainder (``math.fsum``). The expansion of a sum is unique, and sums of expansions are exact. The last axis of an array of
sums holds the doubles of each expansion, padded with zeros.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import chain
from math import fsum, prod

import numpy as np

SPLIT = 134217729.0
"""2²⁷ + 1: splits a double into halves whose products are exact (Dekker 1971)."""
LARGEST = 1e140
"""Largest magnitude of a term. The split of a larger square would overflow."""


def expansion(values: Sequence[float]) -> list[float]:
    """The exact sum of numbers as an expansion."""
    found: list[float] = []
    while (left := fsum(chain(values, (-x for x in found)))) != 0.0:
        found.append(left)
    return found


def sums(columns: np.ndarray) -> np.ndarray:
    """The exact sums of columns (n × m) as expansions (m × doubles).

    First the leading bits of a column's numbers are added: so few bits that n additions are exact. The lower bits follow in the
    same way (Rump, Ogita, Oishi 2008).
    """
    parts, left, carries = [np.zeros(columns.shape[1])], columns, len(columns).bit_length() + 1
    while (top := np.abs(left).max(axis=0, initial=0.0)).any():
        grain = np.ldexp(1.5, np.frexp(top)[1] + carries)
        bits = (left + grain) - grain
        parts.append(bits.sum(axis=0))
        left = left - bits
    return padded([expansion(some) for some in np.transpose(parts).tolist()])


def padded(expansions: Sequence[Sequence[float]]) -> np.ndarray:
    """Expansions as an array (m × doubles)."""
    out = np.zeros((len(expansions), max(map(len, expansions), default=0)))
    for row, numbers in zip(out, expansions, strict=True):
        row[: len(numbers)] = numbers
    return out


def added(arrays: Iterable[np.ndarray]) -> np.ndarray:
    """The elementwise exact sums of arrays of expansions."""
    whole = np.concatenate(list(arrays), axis=-1)
    flat = padded([expansion(numbers) for numbers in _flat(whole).tolist()])
    return flat.reshape(*whole.shape[:-1], flat.shape[-1])


def _flat(array: np.ndarray) -> np.ndarray:
    return array.reshape(prod(array.shape[:-1]), array.shape[-1])


def products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products of numbers (n × m) and their rounding errors (n × m), stacked (2n × m). Product plus error is exact for products
    above 10⁻²⁹⁰."""
    p = a * b
    (ah, al), (bh, bl) = _halves(a), _halves(b)
    return np.concatenate([p, ((ah * bh - p) + ah * bl + al * bh) + al * bl])


def _halves(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    high = SPLIT * x - (SPLIT * x - x)
    return high, x - high


def fractions(array: np.ndarray) -> np.ndarray:
    """Expansions as fractions (an array of objects without the last axis)."""
    out = np.empty(array.shape[:-1], object)
    flat = out.reshape(-1)
    for i, numbers in enumerate(_flat(array).tolist()):
        flat[i] = sum(map(Fraction, numbers), Fraction())
    return out
