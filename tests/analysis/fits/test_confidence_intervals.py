"""Confidence intervals of fits equal textbook intervals. The intervals end at bounds, and show which values the data do not
determine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.special import chdtri

import trunnion
from tests.analysis.fits.closed_form_motions import (
    FORCE,
    GLIDER,
    LINE,
    QD,
    SLIDER,
    TIME,
    Q,
    X,
    noisy,
    regression,
    slid,
    slid_slopes,
)

WIDTH = 3e-3
"""Allowed relative error. Ends are located to 0.1 % of the threshold on either side, and the root of the misfit's rise is
linear."""


def check(found: trunnion.Fit, names: list[str], b: np.ndarray, half: np.ndarray) -> None:
    """Check that values, local and profile intervals equal the values and intervals of a regression."""
    for name, value, wide in zip(names, b, half, strict=True):
        i = found.intervals[name]
        assert found.values[name] == pytest.approx(value, abs=1e-6 * wide)
        assert (i.local[0], i.local[1]) == pytest.approx((value - wide, value + wide), abs=1e-4 * wide)
        assert (i.low, i.high) == pytest.approx((value - wide, value + wide), abs=WIDTH * wide)
        assert (i.low_end, i.high_end) == ("found", "found")


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("level", [0.8, 0.99])
@pytest.mark.parametrize("noise", [None, 0.02])
def test_intervals_of_a_linear_model_are_those_of_regression(noise: float | None, level: float) -> None:
    y = noisy(1)
    found = trunnion.fit(GLIDER, [Q, QD], TIME, {X: y}, noise=noise, level=level)
    check(found, [Q, QD], *regression(LINE, y, level, noise))


def test_runs_share_common_parameters_and_have_their_own_starts() -> None:
    """Two runs have one speed and two starting positions: a regression with one slope and two intercepts. The columns of both runs
    have one common standard deviation of noise."""
    other = np.linspace(0.0, 1.0, 6)
    y, z = noisy(2), noisy(3, time=other, q=-0.3)
    runs = [trunnion.MeasuredRun(TIME, {X: y}), trunnion.MeasuredRun(other, {X: z}, {Q: -0.2}, name="back")]
    found = trunnion.fit(GLIDER, [QD], runs=runs, own=[Q])
    A = np.zeros((15, 3))
    A[:, 0], A[:9, 1], A[9:, 2] = np.concatenate([TIME, other]), 1.0, 1.0
    check(found, [QD, f"{Q} @ run 1", f"{Q} @ back"], *regression(A, np.concatenate([y, z]), 0.95))


def test_a_normal_prior_is_a_further_measurement() -> None:
    y = noisy(4)
    found = trunnion.fit(GLIDER, [Q, QD], TIME, {X: y}, noise=0.02, priors={QD: "normal(0.45 m/s, 0.01 m/s)"})
    A, b = np.vstack([LINE / 0.02, [0.0, 1 / 0.01]]), np.append(y / 0.02, 0.45 / 0.01)
    check(found, [Q, QD], *regression(A, b, 0.95, 1.0))


def test_curves_of_two_units_have_two_noises() -> None:
    y, rate = noisy(5), 0.5 + 0.3 * np.random.default_rng(6).normal(size=9)
    found = trunnion.fit(GLIDER, [Q, QD], TIME, {X: y, "rail.qd[1]": rate})
    told = found.runs[0].noise
    assert 0.01 < told[X] < 0.04
    assert 0.15 < told["rail.qd[1]"] < 0.6
    assert found.values[QD] == pytest.approx(regression(LINE, y, 0.95)[0][1], abs=0.01)


def test_the_profile_of_a_block_that_stops_is_that_of_its_closed_form() -> None:
    """The reference computes the misfit for all pairs of force and speed on a grid. The interval contains a force if its least
    misfit over all speeds is close to the least misfit of all pairs."""
    time, noise = np.linspace(0.0, 1.0, 9), 0.02
    data = slid(2.0, 1.0, time) + noise * np.random.default_rng(7).normal(size=9)
    found = trunnion.fit(SLIDER, [FORCE, QD], time, {X: data}, noise=noise, level=0.9)
    force, v = np.geomspace(1.0, 4.0, 150), np.linspace(0.7, 1.5, 401)
    best = np.array([np.min(np.sum((slid(f, v[:, None], time) - data) ** 2, axis=1)) for f in force])
    inside = force[(best - best.min()) / noise**2 <= chdtri(1, 0.1)]
    i = found.intervals[FORCE]
    assert (i.low, i.high) == pytest.approx((inside[0], inside[-1]), rel=0.01)  # neighbouring forces of the grid differ by 1 %
    assert abs(i.local[1] - i.high) > 0.02 * i.high  # the local interval has a different upper end


def test_an_interval_ends_at_the_bound_that_the_data_do_not_exclude() -> None:
    """The data come from a glider without drag. The data allow zero drag, and any drag with an effect smaller than the noise."""
    found = trunnion.fit(GLIDER, ["joints.rail.damping"], TIME, {X: noisy(9)}, {"joints.rail.damping": 0.01}, noise=0.02)
    i = found.intervals["joints.rail.damping"]
    assert (i.low, i.low_end) == (0.0, "bound")
    assert i.high_end == "found"
    asked = trunnion.fit(GLIDER, [Q, QD], TIME, {X: noisy(1)}, bounds={QD: ("0.49 m/s", None)}, noise=0.02).intervals[QD]
    assert (asked.low, asked.low_end, asked.high_end) == (pytest.approx(0.49), "bound", "found")


def test_the_interval_of_a_larger_number_ends_at_the_smaller_one() -> None:
    """The data come from a block with one friction coefficient; the fitted law has two coefficients. The fit finds the static
    coefficient at the lower end of its range, which is the sliding coefficient."""
    mu, static = "joints.rail.friction.mu", "joints.rail.friction.mu_static"
    rub = {"force": "2 N", "law": "stribeck", "mu": 0.9, "mu_static": 1.1, "v_stribeck": 0.4}
    time = np.linspace(0.0, 1.0, 21)
    data = slid(2.0, 1.0, time) + 3e-3 * np.random.default_rng(1).normal(size=21)
    scene = {**SLIDER, "joints": {"rail": {**SLIDER["joints"]["rail"], "friction": rub}}}
    found = trunnion.fit(scene, [mu, static], time, {X: data})
    assert found.converged
    i = found.intervals[static]
    assert (i.low, i.low_end) == (pytest.approx(found.values[mu]), "bound")
    assert i.low <= found.values[static] < i.high


def test_a_number_right_below_one_that_it_must_not_pass_has_a_derivative() -> None:
    """Static and sliding friction are equal. The difference quotient therefore uses a smaller value of sliding friction."""
    static = {**SLIDER["joints"]["rail"], "friction": {"force": "4 N", "mu": 0.5, "mu_static": 0.5}}
    s = trunnion.sensitivity({**SLIDER, "joints": {"rail": static}}, ["joints.rail.friction.mu"], [X], until=0.8, every=0.1)
    assert s.d(X, "joints.rail.friction.mu") == pytest.approx(4.0 * slid_slopes(2.0, 1.0, s.time)[:, 0], abs=1e-7)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"priors": {QD: "cauchy(1, 2)"}}, "not a valid prior"),
        ({"priors": {Q: "lognormal(0, 1)"}}, "must be positive"),
        ({"bounds": {QD: (0.6, 0.7)}}, "outside the bounds"),
        ({"bounds": {QD: (1, 0)}}, "no value lies"),
        ({"bounds": {"gravity[1]": (0, 1)}}, "not a parameter of the fit"),
        ({"bounds": {QD: ("1 kg", 2)}}, "bounds, joints.rail.start.qd"),
        ({"noise": {"rail.qd[1]": 1.0}}, "no noise is given for rail"),
        ({"noise": 0.0}, "must be positive"),
        ({"level": 95}, "not a probability"),
    ],
)
def test_invalid_priors_bounds_noise_and_levels_are_reported(asked: dict[str, Any], said: str) -> None:
    with pytest.raises(trunnion.SceneError, match=said):
        trunnion.fit(GLIDER, [Q, QD], TIME, {X: noisy(1)}, **asked)


def test_mistakes_in_runs_are_reported_together() -> None:
    runs = [trunnion.MeasuredRun(TIME, {X: TIME[1:]}), trunnion.MeasuredRun(TIME**2, {"rail.q": TIME}, noise=1.0)]
    with pytest.raises(trunnion.SceneError) as told:
        trunnion.fit(GLIDER, [Q], runs=runs)
    with pytest.raises(trunnion.SceneError, match="each run has its own"):
        trunnion.fit(GLIDER, [Q], runs=runs, noise=0.1)
    text = str(told.value)
    assert all(x in text for x in ("run 1", "8 values for 9", "run 2, time", "rail.q is not a column", "for only some of the runs"))


def test_a_misfit_far_above_the_noise_is_reported() -> None:
    found = trunnion.fit(GLIDER, [Q, QD], t := np.linspace(0, 2, 41), {X: 0.1 + 0.5 * t - 0.1 * t**2}, intervals=False)
    assert any("omits an effect" in n for n in found.notes)
    assert not found.intervals
    assert math.isfinite(found.deviation[Q])
