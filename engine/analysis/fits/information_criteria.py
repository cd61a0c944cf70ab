"""Information criteria for fits of different models to the same data, and a test of whether the misfit is white noise."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics.json_values import finite
from trunnion.basics.lazy_data_classes import dataclass

if TYPE_CHECKING:
    from trunnion.analysis.fits.measurements import CurveComparison

CORRELATED = 4.0
"""The misfit counts as more than white noise if the correlation of neighbouring misfits exceeds this multiple of 1/√n. For white
noise, 1/√n is the standard deviation of this correlation."""


@dataclass(frozen=True)
class Criteria:
    """Information criteria of a fit.

    Attributes:
        likelihood: −2 log of the maximum likelihood.
        numbers: number of estimated parameters, including estimated noise levels.
        values: number of measured values.
        aicc: Akaike's criterion with its small-sample correction; infinite for too few values.
        bic: Schwarz's criterion.
    """

    likelihood: float
    numbers: int
    values: int
    aicc: float
    bic: float

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers. Infinite numbers become None."""
        return finite(asdict(self))


def compute_criteria(misfit: np.ndarray, noise: np.ndarray, groups: np.ndarray, given: bool, parameters: int) -> Criteria:
    """Criteria of a fit with ``misfit`` (N) and ``noise`` (N). ``given`` says whether the noise was given, or estimated for each
    of the ``groups`` (N)."""
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


def note_correlated_misfits(runs: Iterable[CurveComparison]) -> list[str]:
    """A note for every curve whose misfit is not white noise. In this case the model is wrong, and the intervals are too
    narrow."""
    out = []
    for r in runs:
        for c, v in r.measured.items():
            misfit = r.model[c] - v
            size = float(misfit @ misfit)
            neighbours = float(misfit[1:] @ misfit[:-1]) / size if size > 0.0 else 0.0
            if abs(neighbours) > CORRELATED / math.sqrt(len(v)) and np.abs(misfit).max() > 1e-6 * np.abs(v).max():
                said = (
                    f"{r.name}, {c}: the differences from the measurement at neighbouring times are correlated by {neighbours:.2g}"
                )
                out.append(f"{said}; such differences are not noise: the model omits an effect, and the intervals are too narrow")
    return out
