"""Distributions of numbers in a sample: uniform between two bounds, or named distributions such as ``normal(0.3, 0.05)``, with
units.

Each distribution is given by its inverse distribution function. The function takes uniform numbers in (0, 1), so that all sampling
methods can use it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from math import exp, isfinite, log, sqrt
from statistics import NormalDist
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass

WRITTEN = re.compile(r"^\s*([a-z]+)\s*\(([^()]*)\)\s*$")
BELOW_ONE = 1.0 - 2.0**-53
Inverse = Callable[[np.ndarray], np.ndarray]
NORMAL = NormalDist()


@dataclass(frozen=True)
class Kind:
    """A named distribution.

    Attributes:
        numbers: names of its parameters; optional parameters come last.
        needed: number of required parameters.
        wrong: function from parameters to the description of a mistake; "" if there is no mistake.
        inverse: function from parameters to the inverse distribution function.
    """

    numbers: tuple[str, ...]
    needed: int
    wrong: Callable[[Sequence[float]], str]
    inverse: Callable[[Sequence[float]], Inverse]


def _standard(u: np.ndarray) -> np.ndarray:
    """Standard normal numbers from uniform numbers."""
    inside = np.clip(u, 2.0**-54, BELOW_ONE)
    return np.fromiter(map(NORMAL.inv_cdf, inside.ravel().tolist()), float, inside.size).reshape(u.shape)


def _normal(n: Sequence[float]) -> Inverse:
    mean, deviation, *ends = n
    low, high = (NORMAL.cdf((end - mean) / deviation) for end in ends) if ends else (0.0, 1.0)

    def inverse(u: np.ndarray) -> np.ndarray:
        found = mean + deviation * _standard(low + (high - low) * u)
        return np.clip(found, ends[0], ends[1]) if ends else found

    return inverse


def _lognormal(n: Sequence[float]) -> Inverse:
    spread = sqrt(log(1.0 + (n[1] / n[0]) ** 2))
    middle = n[0] * exp(-0.5 * spread * spread)
    return lambda u: middle * np.exp(spread * _standard(u))


def _triangular(n: Sequence[float]) -> Inverse:
    low, mode, high = n
    whole, at = high - low, (mode - low) / (high - low)

    def inverse(u: np.ndarray) -> np.ndarray:
        return np.where(u < at, low + whole * np.sqrt(u * at), high - whole * np.sqrt((1.0 - u) * (1.0 - at)))

    return inverse


def _wrong_normal(n: Sequence[float]) -> str:
    if n[1] <= 0.0:
        return "the standard deviation must be positive"
    if len(n) == 3:
        return "truncation needs both ends"
    if len(n) == 4 and not n[2] < n[3]:
        return "the ends of the truncation must increase"
    if len(n) == 4 and not NORMAL.cdf((n[3] - n[0]) / n[1]) - NORMAL.cdf((n[2] - n[0]) / n[1]) > 1e-6:
        return "the truncated range has less than 1e-6 of the probability"
    return ""


KINDS: dict[str, Kind] = {
    "uniform": Kind(("low", "high"), 2, lambda n: "", lambda n: lambda u: n[0] + (n[1] - n[0]) * u),
    "normal": Kind(("mean", "deviation", "low", "high"), 2, _wrong_normal, _normal),
    "lognormal": Kind(
        ("mean", "deviation"), 2, lambda n: "" if min(n) > 0.0 else "mean and standard deviation must be positive", _lognormal
    ),
    "triangular": Kind(
        ("low", "mode", "high"),
        3,
        lambda n: "" if n[0] <= n[1] <= n[2] and n[0] < n[2] else "low, mode and high must increase",
        _triangular,
    ),
}
"""Distributions by name. Mean and standard deviation refer to the number itself, also for ``lognormal``."""
FORMS = ", ".join(f"{name}({', '.join(k.numbers[: k.needed])})" for name, k in KINDS.items() if name != "uniform")
HINT = f"two ends such as [0.1, 0.6], or one of {FORMS}"


def spread_of(given: Any, number: Callable[[Any], float], complain: Callable[[str, str], None]) -> Inverse | None:
    """The inverse distribution function for two bounds or for a text such as "normal(0.3, 0.05)"; None after a mistake.

    number: function that reads one number. After a mistake, this function reports the mistake and returns NaN. complain: function
    that reports any other mistake.
    """
    name, numbers = "uniform", given
    if isinstance(given, str):
        written = WRITTEN.match(given)
        if written is None or written[1] not in KINDS:
            complain(f"{given[:80]!r} is not a distribution", HINT)
            return None
        name, numbers = written[1], [x.strip() for x in written[2].split(",")]
    if not isinstance(numbers, Sequence) or (name == "uniform" and len(numbers) != 2):
        complain("a range is a low end and a high end", HINT)
        return None
    kind = KINDS[name]
    if not kind.needed <= len(numbers) <= len(kind.numbers):
        complain(f"{name} takes {', '.join(kind.numbers)}, not {len(numbers)} numbers", HINT)
        return None
    read = [number(x) for x in numbers]
    if not all(map(isfinite, read)):
        return None
    if wrong := kind.wrong(read):
        complain(f"{given}: {wrong}", f"{name}({', '.join(kind.numbers)})")
        return None
    return kind.inverse(read)
