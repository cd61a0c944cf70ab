"""Intervals contain the true values with the stated probability. The data are synthetic noisy measurements of motions that include
a stop."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

import trunnion
from tests.analysis.fits.closed_form_motions import slid, slid_slopes
from tests.benchmarks.numerical_error.fit_interval_coverage import covered
from trunnion.analysis.fits.bounds_and_priors import BoundsAndPriors
from trunnion.analysis.fits.identifiability import slope_spectrum
from trunnion.analysis.fits.least_squares_objective import Objective
from trunnion.analysis.fits.profile_likelihood import Profiles, threshold

TRUTH, NOISE, SETS, LEVEL = np.array([2.0, 1.0]), 0.02, 40, 0.9
TIME = np.linspace(0.0, 1.0, 13)


def closed(data: np.ndarray, noise: float | None) -> Any:
    """The ``ModelCurves`` of the sliding block's closed form."""
    runs = [trunnion.MeasuredRun(TIME, {"x": data}, {}, noise)]
    return SimpleNamespace(
        runs=runs, rtol=1e-9, exact=True, pairs=[], apply_order=lambda p: p,
        values=lambda p: slid(*p, TIME), slopes=lambda p: (slid(*p, TIME), slid_slopes(*p, TIME)),
    )  # fmt: skip


def held(seed: int, noise: float | None) -> list[bool]:
    """Whether the profile interval of each number contains the true value."""
    data = slid(*TRUTH, TIME) + NOISE * np.random.default_rng(seed).normal(size=len(TIME))
    known = BoundsAndPriors(("force", "v"), np.full(2, 1e-6), np.full(2, np.inf), {})
    objective = Objective(closed(data, noise), known, TRUTH, np.zeros(len(TIME), int))
    u, _, converged = objective.minimise(np.ones(2))
    assert converged
    profiles = Profiles(objective, u, threshold(LEVEL, objective.nu))
    local = slope_spectrum(profiles.J, len(TIME), profiles.t, True).deviations
    intervals = [profiles.interval(k, float(local[k])) for k in range(2)]
    return [i.low <= x <= i.high for x, i in zip(TRUTH, intervals, strict=True)]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("noise", [NOISE, None])
def test_intervals_hold_the_truth_with_their_stated_probability(noise: float | None) -> None:
    """The test computes 90 % intervals from 40 data sets. The number of intervals that contain the true value is binomial. The
    accepted range excludes 0.05 % of this distribution on each side."""
    counts = np.sum([held(s, noise) for s in range(SETS)], axis=0)
    low, high = stats.binom.ppf([0.0005, 0.9995], SETS, LEVEL)
    assert all(low <= c <= high for c in counts)


@pytest.mark.slow
def test_intervals_of_the_engines_own_fits_hold_the_truth() -> None:
    """The test fits 100 of the data sets of ``python -m tests.benchmarks.numerical_error.fit_interval_coverage``, with the engine's
    runs and slopes. Of the 95 % intervals, 93 to 97 % must contain the true value, plus or minus two standard errors of 100
    sets."""
    both = covered(100)["all"]
    for count in (both.local, both.profile):
        share = count / both.intervals
        error = 2.0 * np.sqrt(0.95 * 0.05 / both.intervals)
        assert 0.93 - error <= share <= 0.97 + error
