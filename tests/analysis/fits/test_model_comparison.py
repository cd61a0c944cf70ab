"""Laws are compared by likelihood and by the number of their parameters; experiments are compared by the information that they
would add."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

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
from trunnion.analysis.fits.information_criteria import compute_criteria
from trunnion.analysis.fits.model_comparison import rank_fits
from trunnion.analysis.fits.model_curves import ModelCurves

RUB = "joints.rail.friction."


def test_the_criteria_are_those_of_the_normal_likelihood() -> None:
    """The reference for BIC and AICc is the normal density of the residuals of a regression. The regression has three parameters,
    including the deviation of the noise."""
    y = noisy(1)
    found = trunnion.fit(GLIDER, [Q, QD], TIME, {X: y}, intervals=False)
    r = y - LINE @ regression(LINE, y, 0.95)[0]
    likelihood = -2.0 * stats.norm.logpdf(r, scale=np.sqrt(np.mean(r**2))).sum()
    assert found.criteria is not None
    assert found.criteria.likelihood == pytest.approx(likelihood, rel=1e-9)
    assert found.criteria.bic == pytest.approx(likelihood + 3 * math.log(9), rel=1e-9)
    assert found.criteria.aicc == pytest.approx(likelihood + 6 + 2 * 3 * 4 / (9 - 3 - 1), rel=1e-9)
    given = compute_criteria(r, np.full(9, 0.05), np.zeros(9, int), True, 2)
    assert given.likelihood == pytest.approx(-2.0 * stats.norm.logpdf(r, scale=0.05).sum(), rel=1e-12)
    assert given.bic == pytest.approx(given.likelihood + 2 * math.log(9), rel=1e-12)


def test_too_few_values_for_their_numbers_have_no_aicc() -> None:
    assert math.isinf(compute_criteria(np.ones(4), np.ones(4), np.zeros(4, int), False, 2).aicc)


@pytest.fixture(scope="module")
def stribeck() -> trunnion.ModelComparison:
    """Comparison of Coulomb's and Stribeck's law for a block. The block's static friction is 1.5 times its friction in fast
    sliding."""
    scene = {**SLIDER, "joints": {"rail": {**SLIDER["joints"]["rail"], "friction": {"force": "2 N", "mu": 1.2}}}}
    own = {RUB + "law": "stribeck", RUB + "mu": 1.0, RUB + "mu_static": 1.5, RUB + "v_stribeck": 0.5}
    run = trunnion.simulate(scene, 0.8, 0.02, rtol=1e-9, overrides=own, outputs=[X])
    curve = run[X] + 1e-3 * np.random.default_rng(3).normal(size=len(run))
    first = {RUB + "mu_static": 1.4, RUB + "v_stribeck": 0.5}
    candidates = {"coulomb": (), "stribeck": trunnion.Candidate([RUB + "mu_static"], "stribeck", first)}
    return trunnion.compare(scene, candidates, [RUB + "mu"], run.time, {X: curve}, intervals=False)


def test_the_law_that_made_the_data_is_found(stribeck: trunnion.ModelComparison) -> None:
    best, other = stribeck.candidates
    assert (best.name, other.name) == ("stribeck", "coulomb")
    assert other.worse_by_bic > 10
    assert best.weight > 0.99
    assert best.fit is not None
    assert best.fit.values[RUB + "mu_static"] == pytest.approx(1.5, abs=4 * best.fit.deviation[RUB + "mu_static"])


def test_laws_with_the_same_curves_are_reported_as_alike() -> None:
    """A block slides to rest under Coulomb's law and under the regularised Coulomb law."""
    time = np.linspace(0.0, 1.0, 13)
    curve = slid(2.0, 1.0, time) + 0.005 * np.random.default_rng(4).normal(size=13)
    told = trunnion.compare(SLIDER, {"coulomb": (), "regularized": ()}, [FORCE, QD], time, {X: curve}, intervals=False)
    assert {c.name for c in told.candidates} == {"coulomb", "regularized"}
    assert told.candidates[1].worse_by_bic < 0.1
    assert any(n.startswith("the data do not decide") and "regularized" in n for n in told.notes)


def test_mistakes_in_all_candidates_are_reported_together() -> None:
    candidates = {"colomb": [FORCE], "stribeck": [FORCE], "coulomb": ["joints.rail.nothing"]}
    with pytest.raises(trunnion.SceneError) as told:
        trunnion.compare(SLIDER, candidates, [QD], TIME, {X: TIME})
    text = str(told.value)
    assert all(x in text for x in ("candidate colomb", "not a friction law", "candidate stribeck", "mu_static", "rail.nothing"))


def test_a_candidate_that_cannot_be_run_is_kept_with_its_reason(stribeck: trunnion.ModelComparison) -> None:
    fit = stribeck.best.fit
    assert fit is not None
    told = rank_fits({"a": fit, "b": "the run ends early"})
    assert (told.candidates[1].fit, told.candidates[1].why) == (None, "the run ends early")
    with pytest.raises(trunnion.SimulationError, match="ends early"):
        rank_fits({"b": "the run ends early"})


def test_differenced_slopes_are_those_of_the_closed_form() -> None:
    """The engine computes slopes of smooth, stiff laws by finite differences. Across the stop of the block, the error is of second
    order in the step."""
    scene = trunnion.scene.overrides.scene_given(SLIDER, None)
    time = np.linspace(0.0, 1.0, 12)  # the times exclude the stop, where the second derivative is one-sided
    curves = ModelCurves(scene, [FORCE, QD], (), [trunnion.MeasuredRun(time, {X: time}, name="run")], 1e-10)
    at = np.array([2.0, 1.0])
    for found in (curves._differences(at), curves.slopes(at)):
        assert found[0] == pytest.approx(slid(*at, time), abs=1e-8)
        assert found[1] == pytest.approx(slid_slopes(*at, time), abs=1e-5)


# -- Experiments ----------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def line() -> trunnion.Fit:
    return trunnion.fit(GLIDER, [Q, QD], TIME, {X: noisy(1)}, noise=0.02, intervals=False)


def information(times: np.ndarray, sizes: np.ndarray, deviation: float) -> np.ndarray:
    A = np.column_stack([np.ones(len(times)), times]) * sizes / deviation
    return A.T @ A


def test_the_gain_of_an_experiment_is_that_of_its_information(line: trunnion.Fit) -> None:
    """For a straight line, the matrices of the regressions are the reference. More precise and longer experiments give more
    information."""
    longer, sharper = trunnion.Experiment(until="8 s", every="1 s"), trunnion.Experiment(noise=0.005)
    trials: dict[str, Any] = {"again": {}, "longer": longer, "sharper": sharper}
    told = {p.name: p for p in trunnion.propose(line, trials)}
    assert list(told) == ["longer", "sharper", "again"] or list(told) == ["sharper", "longer", "again"]
    sizes = np.array([line.values[Q], line.values[QD]])
    now = information(TIME, sizes, 0.02) + np.eye(2)
    for name, times, deviation in (("again", TIME, 0.02), ("longer", np.arange(9.0), 0.02), ("sharper", TIME, 0.005)):
        after = now + information(times, sizes, deviation)
        gain = 0.5 * math.log2(np.linalg.det(after) / np.linalg.det(now))
        assert told[name].gain == pytest.approx(gain, rel=1e-6)
        assert told[name].deviation[QD] == pytest.approx(math.sqrt(np.linalg.inv(after)[1, 1]) * sizes[1], rel=1e-6)


def test_a_start_that_has_to_be_found_too_takes_its_share() -> None:
    """The start of each run is unknown. A further run therefore adds less information about the speed than with a known start."""
    found = trunnion.fit(GLIDER, [QD], runs=[trunnion.MeasuredRun(TIME, {X: noisy(1)}, noise=0.02)], own=[Q], intervals=False)
    (again,) = trunnion.propose(found, {"again": {}})
    alone = 0.02 / math.sqrt(np.sum((TIME - TIME.mean()) ** 2))
    assert found.deviation[QD] == pytest.approx(alone, rel=1e-4)
    # the reference prior changes the standard deviation by 0.1 %
    assert again.deviation[QD] == pytest.approx(alone / math.sqrt(2.0), rel=1e-2)


def test_mistakes_in_all_trials_are_reported_together(line: trunnion.Fit) -> None:
    trials = {
        "a": {"joints.rial.start.q": 1.0},
        "b": trunnion.Experiment(outputs="rail.qd[1]"),
        "c": trunnion.Experiment(until="5 kg"),
    }
    with pytest.raises(trunnion.SceneError) as told:
        trunnion.propose(line, trials)
    assert all(x in str(told.value) for x in ("trial a", "trial b, noise", "trial c, until"))
