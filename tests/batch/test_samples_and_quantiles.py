"""Samples follow their distributions, and the intervals of their quantiles contain the true quantiles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from tests.batch.synthetic_results import MU, OF, RADIUS, SEEDS, G, scene, table
from trunnion.basics.errors import SceneError
from trunnion.batch.cases.grids_and_samples import sampled
from trunnion.batch.sample_statistics.result_queries import spreads_of

# -- distributions ----------------------------------------------------------------------------------------------------------

SPREADS = {
    "normal(0.3, 0.05)": stats.norm(0.3, 0.05),
    "lognormal(0.3, 0.15)": stats.lognorm(np.sqrt(np.log(1.25)), scale=0.3 / np.sqrt(1.25)),
    "triangular(0.1, 0.2, 0.6)": stats.triang(0.2, 0.1, 0.5),
    "triangular(0.1, 0.1, 0.6)": stats.triang(0.0, 0.1, 0.5),
    "normal(0.3, 0.2, 0.1, 0.4)": stats.truncnorm(-1.0, 0.5, 0.3, 0.2),
    "uniform(0.1, 0.6)": stats.uniform(0.1, 0.5),
}


@pytest.mark.parametrize("method", ["latin", "sobol", "random"])
@pytest.mark.parametrize("written", SPREADS)
def test_numbers_are_spread_as_written(written: str, method: str) -> None:
    """Each of n cases of an even sample lies within 1/n of its place in the distribution. A random sample obeys Kolmogorov's limit:
    one seed in a thousand would exceed this limit, but not the seed of this test."""
    n, of = 256, SPREADS[written]
    x = sampled(scene(), {MU: written}, n, 3, method).values(0, n)[:, 0]
    off = np.abs(np.sort(of.cdf(x)) - (np.arange(n) + 0.5) / n).max()
    assert off <= (1.95 / np.sqrt(n) if method == "random" else 1.0 / n)
    mean, variance = (float(m) for m in of.stats("mv"))
    assert x.mean() == pytest.approx(mean, abs=(4.0 if method == "random" else 0.3) * np.sqrt(variance / n))


def test_distributions_take_units_and_every_mistake_in_them_is_reported() -> None:
    good = sampled(scene(), {RADIUS: "normal(50 mm, 0.5 mm)"}, 64).values(0, 64)
    assert (good.mean(), good.std()) == (pytest.approx(0.05, rel=1e-3), pytest.approx(0.0005, rel=0.05))
    wrong = {MU: "normal(0.3)", RADIUS: "triangular(1 mm, 3 mm, 2 mm)", G: "gauss(1, 2)", "gravity[2]": "normal(1, -2)",
             "gravity[1]": "lognormal(0, 1 kg)"}  # fmt: skip
    with pytest.raises(SceneError) as e:
        sampled(scene(), wrong, 64)
    assert {p.where for p in e.value.problems} == {f"sample.{path}" for path in wrong}
    with pytest.raises(SceneError, match="too few"):
        sampled(scene(), {MU: (0, 1)}, 8, 0, "saltelli")


def test_sobol_points_fill_every_box_of_their_net_and_the_seed_decides_which_they_are() -> None:
    """The first two Sobol numbers form a net: for every a, each of the 64 boxes of size 2^-a by 2^-(6 - a) contains one of 64
    points."""
    cases = sampled(scene(), {MU: (0, 1), G: (0, 1)}, 64, 5, "sobol")
    x = cases.values(0, 64)
    for a in range(7):
        boxes = {(int(p * 2**a), int(q * 2 ** (6 - a))) for p, q in x}
        assert len(boxes) == 64
    assert (cases.values(17, 20) == x[17:20]).all()
    assert (sampled(scene(), {MU: (0, 1), G: (0, 1)}, 64, 6, "sobol").values(0, 64) != x).all()


# -- quantiles --------------------------------------------------------------------------------------------------------------


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("method", ["random", "latin", "sobol"])
def test_intervals_of_quantiles_and_of_exceedance_hold_the_true_ones(method: str) -> None:
    """The result is the exponential of a normal number. Intervals contain the true value for at least 95 % of the seeds, less three
    standard deviations."""
    at, bound = (0.05, 0.5, 0.9), 2.0
    true = [*np.exp(stats.norm.ppf(at)), stats.norm.sf(np.log(bound))]
    held = []
    for seed in range(SEEDS):
        cases = sampled(scene(), {MU: "normal(0, 1)"}, 200, seed, method)
        (s,) = spreads_of(cases, [OF], table(cases, lambda x: np.exp(x[:, 0])), (), at, {OF.name: [bound]})
        held.append([e.low <= t <= e.high for t, (_, e) in zip(true, (*s.quantiles, *s.above), strict=True)])  # type: ignore[operator]
    assert np.mean(held, axis=0).min() >= 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)


def test_intervals_hold_whatever_the_cases_without_a_value_would_have_given() -> None:
    cases = sampled(scene(), {MU: (0, 1)}, 400, 1, "random")
    x = cases.values(0, 400)[:, 0]
    asked: Any = ((), (0.02, 0.3, 0.98), {OF.name: [0.5]})
    (some,) = spreads_of(cases, [OF], table(cases, lambda x: x[:, 0], lambda x: x[:, 0] % 0.1 < 0.01), *asked)
    assert some.missing == int((x % 0.1 < 0.01).sum())
    for filled in (-1.0, 0.5001, 2.0):
        one = table(cases, lambda x, v=filled: np.where(x[:, 0] % 0.1 < 0.01, v, x[:, 0]))  # type: ignore[misc]
        (whole,) = spreads_of(cases, [OF], one, *asked)
        for (_, a), (_, b) in zip((*some.quantiles, *some.above), (*whole.quantiles, *whole.above), strict=True):
            assert a.low is None or (b.low is not None and a.low <= b.low)
            assert a.high is None or (b.high is not None and b.high <= a.high)
    assert (some.quantiles[0][1].low, some.quantiles[2][1].high) == (None, None)


def test_a_crossed_sample_is_asked_for_quantiles_by_its_own_cases_alone() -> None:
    cases = sampled(scene(), {MU: (0, 1), G: (0, 1)}, 64, 0, "saltelli")
    (s,) = spreads_of(cases, [OF], table(cases, lambda x: x[:, 0]))
    assert s.cases == 128


def test_questions_that_mean_nothing_are_refused() -> None:
    cases, none = sampled(scene(), {MU: (0, 1)}, 64), table(sampled(scene(), {MU: (0, 1)}, 64), ishigami_of_one)
    for asked in ({"at": (0.0,)}, {"at": (1.5,)}, {"of": ["max:y"]}, {"above": {"max:y": [1]}}, {"above": {OF.name: ["3 kg"]}}):
        with pytest.raises(SceneError):
            spreads_of(cases, [OF], none, **asked)  # type: ignore[arg-type]


def ishigami_of_one(x: np.ndarray) -> np.ndarray:
    return np.sin(x[:, 0])
