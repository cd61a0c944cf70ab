"""Numbers by which fits of different laws to the same data are compared, and a test of whether the misfit is noise."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from engine.fits.api import Followed

ODD = 4.0
"""Standard deviations of the correlation of neighbouring values of white noise (1/√n) above which the misfit is none."""


@dataclass(frozen=True)
class Criteria:
    """likelihood: −2 log of the largest one; numbers: how many were fitted, estimated noises among them; values: how many were
    measured; aicc, bic: Akaike's criterion for small samples (infinite where there are too few values), and Schwarz's."""

    likelihood: float
    numbers: int
    values: int
    aicc: float
    bic: float

    def document(self) -> dict[str, Any]:
        """As plain data; infinite ones are None."""
        return {k: v if math.isfinite(v) else None for k, v in asdict(self).items()}


def criteria(misfit: np.ndarray, noise: np.ndarray, groups: np.ndarray, given: bool, parameters: int) -> Criteria:
    """Criteria of a fit with this misfit (N) under noise (N): given, or one estimated for each group."""
    n, numbers = len(misfit), parameters
    if given:
        total = float(np.sum((misfit / noise) ** 2 + np.log(2.0 * math.pi * noise**2)))
    else:
        total = 0.0
        for g in set(groups.tolist()):
            here = groups == g
            variance = max(float(np.mean(misfit[here] ** 2)), 1e-300)
            total += int(here.sum()) * (math.log(2.0 * math.pi * variance) + 1.0)
            numbers += 1
    free = n - numbers - 1
    more = 2.0 * numbers * (numbers + 1) / free if free > 0 else math.inf
    return Criteria(total, numbers, n, total + 2.0 * numbers + more, total + numbers * math.log(n))


def coloured(runs: Iterable[Followed]) -> list[str]:
    """A note for every curve whose misfit is no white noise: then it is the model that is off, and intervals are too narrow."""
    out = []
    for r in runs:
        for c, v in r.measured.items():
            misfit = r.model[c] - v
            size = float(misfit @ misfit)
            neighbours = float(misfit[1:] @ misfit[:-1]) / size if size > 0.0 else 0.0
            if abs(neighbours) > ODD / math.sqrt(len(v)) and np.abs(misfit).max() > 1e-6 * np.abs(v).max():
                said = f"{r.name}, {c}: neighbouring misfits are correlated by {neighbours:.2g}"
                out.append(f"{said}: not noise alone; the model leaves something out, and intervals are too narrow")
    return out
