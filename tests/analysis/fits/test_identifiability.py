"""The fit names numbers that the data cannot separate, and the combinations that the data determine. A prior determines the
remaining combinations."""

from __future__ import annotations

import math

import numpy as np
import pytest

import trunnion
from tests.analysis.fits.closed_form_motions import SLIDER, slid
from tests.benchmarks.numerical_error.fit_interval_coverage import PENDULUM
from trunnion.analysis.fits.identifiability import find_unidentifiable, slope_spectrum

MU, RADIUS = "joints.pivot.friction.mu", "joints.pivot.friction.radius"
TIME = np.linspace(0.0, 0.6, 13)
NOISE = 2e-3


@pytest.fixture(scope="module")
def found() -> trunnion.Fit:
    exact = trunnion.simulate(PENDULUM, 0.6, 0.05, rtol=1e-10, outputs=["pivot.q[1]"])["pivot.q[1]"]
    measured = exact + NOISE * np.random.default_rng(1).normal(size=len(exact))
    prior = {RADIUS: "lognormal(30 mm, 6 mm)"}
    return trunnion.fit(PENDULUM, [MU, RADIUS], TIME, {"pivot.q[1]": measured}, noise=NOISE, priors=prior)


def test_friction_and_radius_of_a_journal_are_named(found: trunnion.Fit) -> None:
    """The torque is r μ/√(1 + μ²) times the load. The determined combination is the radius times μ to the power 1/(1 + μ²)."""
    (pair,) = found.inseparable
    assert set(pair.names) == {MU, RADIUS}
    assert pair.exact
    assert pair.confirmed
    ((exponents, deviation),) = pair.determined
    by = dict(zip(pair.names, exponents, strict=True))
    assert by[MU] / by[RADIUS] == pytest.approx(1.0 / (1.0 + found.values[MU] ** 2), rel=1e-3)
    assert 0.0 < deviation < 0.1
    told = next(n for n in found.notes if "cannot separate" in n)
    assert f"about {MU} · {RADIUS}" in told
    assert "fix the value of one parameter" in told


def test_a_number_that_only_a_prior_determines_has_the_priors_interval(found: trunnion.Fit) -> None:
    """The data contain no information about the radius alone, so the interval of the radius is the interval of the log-normal
    prior."""
    spread = math.sqrt(math.log(1.0 + 0.2**2))
    middle = math.log(0.03) - 0.5 * spread**2
    i = found.intervals[RADIUS]
    assert (math.log(i.low), math.log(i.high)) == pytest.approx((middle - 1.96 * spread, middle + 1.96 * spread), abs=0.01)
    assert found.deviation[RADIUS] == pytest.approx(spread * found.values[RADIUS], rel=0.01)


def test_without_a_prior_force_and_coefficient_of_friction_are_undetermined() -> None:
    """Friction μ F brakes a block, and the data exclude no value of μ or F. The standard deviations of μ and F are infinite, not
    results of a pseudo-inverse."""
    scene = {**SLIDER, "joints": {"rail": {**SLIDER["joints"]["rail"], "friction": {"force": "2 N", "mu": 1.0}}}}
    force, mu = "joints.rail.friction.force", "joints.rail.friction.mu"
    time = np.linspace(0.0, 1.0, 12)
    data = slid(2.0, 1.0, time) + 0.01 * np.random.default_rng(1).normal(size=12)
    found = trunnion.fit(scene, [force, mu], time, {"rail.q[1]": data}, noise=0.01, bounds={force: ("1.5 N", "2.5 N")})
    (pair,) = found.inseparable
    assert pair.confirmed
    assert pair.determined[0][0] == pytest.approx((1.0, 1.0))
    assert all(math.isinf(d) for d in found.deviation.values())
    assert np.isnan(found.correlation[0, 1])
    i = found.intervals[force]
    assert (i.low, i.low_end, i.high, i.high_end) == (pytest.approx(1.5), "bound", pytest.approx(2.5), "bound")
    other = found.intervals[mu]  # the bounds of the force limit the interval of μ
    product = found.values[force] * found.values[mu]
    assert (other.low, other.high) == pytest.approx((product / 2.5, product / 1.5), rel=0.05)


def test_groups_that_have_nothing_to_do_with_each_other_are_named_apart() -> None:
    """The data are slopes of a·b, c²·d and e. The fit reports two groups, each with one combination; e is in neither group."""
    random = np.random.default_rng(2)
    x, y, z = random.normal(size=(3, 40))
    J = 1e3 * np.column_stack([x, x, 2 * y, y, z])
    seen = slope_spectrum(J, 40, 2.0, True)
    groups = find_unidentifiable("abcde", seen, np.ones(5, bool), np.ones(5), lambda k: True)
    assert {g.names: g.determined[0][0] for g in groups} == {
        ("a", "b"): pytest.approx((1.0, 1.0)), ("c", "d"): pytest.approx((1.0, 0.5)),
    }  # fmt: skip
    assert np.isinf(seen.deviations).tolist() == [True, True, True, True, False]
    assert seen.deviations[4] == pytest.approx(1e-3 / np.linalg.norm(z - np.column_stack([x, y]) @ np.linalg.lstsq(
        np.column_stack([x, y]), z, rcond=None)[0]))  # fmt: skip


def test_numbers_that_noise_makes_inseparable_are_named_until_profiles_decide() -> None:
    """Two slopes differ by 0.1 %, which is less than the noise can resolve. The numbers are inseparable with this noise, but
    separable with less noise."""
    random = np.random.default_rng(3)
    x, y = random.normal(size=(2, 40))
    seen = slope_spectrum(np.column_stack([x, x + 1e-3 * y]) * 100.0, 40, 2.0, True)
    (pair,) = find_unidentifiable("ab", seen, np.ones(2, bool), np.ones(2), lambda k: False)
    assert not pair.exact
    assert not pair.confirmed
    assert "not flat" in pair.describe()
    assert np.isfinite(seen.deviations).all()
