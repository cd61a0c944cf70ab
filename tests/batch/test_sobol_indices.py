"""Sobol indices of crossed samples, for a function with known indices and for example 8.3. The interval of each index contains the
true index."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy import stats

import trunnion
from tests.batch.synthetic_results import GUIDE, OF, SEEDS, THREE, TRAVEL, scene, table
from trunnion.basics.errors import SceneError
from trunnion.batch.cases.grids_and_samples import sampled
from trunnion.batch.sample_statistics.result_queries import indices_of
from trunnion.batch.sample_statistics.sobol_indices import Indices
from trunnion.cli import main


def ishigami(x: np.ndarray) -> np.ndarray:
    """Ishigami and Homma's function, with the constants 7 and 0.1."""
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def known() -> np.ndarray:
    """First and total indices of the function, and indices of pairs, in closed form."""
    one, two = 0.5 * (1.0 + 0.1 * np.pi**4 / 5.0) ** 2, 49.0 / 8.0
    both = 0.01 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    return np.array([one, two, 0.0, one + both, two, both, 0.0, both, 0.0]) / (one + two + both)


def numbers(i: Indices) -> np.ndarray:
    """All indices as value, low, high."""
    return np.array([(e.value, e.low, e.high) for e in (*i.first, *i.total, *i.second.values())], float)


@pytest.mark.slow
def test_intervals_of_indices_hold_the_true_ones_with_their_stated_probability() -> None:
    """For Ishigami's function, each of nine intervals contains the true index for at least nine of ten seeds. Of all intervals, 95
    ± 2 % contain the true index (with a standard error of 0.5 %). More points give narrower intervals."""
    held, wide = [], []
    for seed in range(SEEDS):
        cases = sampled(scene(), dict.fromkeys(THREE, (-np.pi, np.pi)), 256, seed, "saltelli")
        (found,) = indices_of(cases, [OF], table(cases, ishigami))
        n = numbers(found)
        held.append((n[:, 1] <= known()) & (known() <= n[:, 2]))
        wide.append(n[:, 2] - n[:, 1])
    often = np.mean(held, axis=0)
    assert often.min() >= 0.88
    assert often.mean() == pytest.approx(0.95, abs=0.025)
    cases = sampled(scene(), dict.fromkeys(THREE, (-np.pi, np.pi)), 2048, 0, "saltelli")
    n = numbers(indices_of(cases, [OF], table(cases, ishigami))[0])
    assert (n[:, 2] - n[:, 1] < 0.5 * np.mean(wide, axis=0)).all()
    assert n[:, 0] == pytest.approx(known(), abs=0.03)


def test_indices_are_those_that_scipy_finds_from_the_same_cases() -> None:
    cases = sampled(scene(), dict.fromkeys(THREE, (-np.pi, np.pi)), 1024, 1, "saltelli")
    f = ishigami(cases.values(0, cases.count)).reshape(1024, 8)
    got = stats.sobol_indices(func={"f_A": f[:, 0], "f_B": f[:, 7], "f_AB": f[:, 1:4].T[:, None, :]}, n=1024)
    n = numbers(indices_of(cases, [OF], table(cases, ishigami))[0])
    assert n[:3, 0] == pytest.approx(got.first_order.ravel(), abs=0.02)
    assert n[3:6, 0] == pytest.approx(got.total_order.ravel(), abs=0.02)


def by_quadrature(name: str, ranges: dict[str, tuple[float, float]], of: str, **run: Any) -> np.ndarray:
    """First and total indices and indices of pairs for a smooth result of a scene. The indices are computed from values at Gauss's
    points."""
    points, weights = np.polynomial.legendre.leggauss(5)
    weights = weights / 2.0
    axes = [low + (high - low) * (points + 1.0) / 2.0 for low, high in ranges.values()]
    cases = [dict(zip(ranges, x, strict=True)) for x in product(*axes)]
    t = trunnion.sweep(name, cases=cases, reductions=of, **run).table
    assert set(t["outcome"].to_pylist()) == {"done"}
    f = t[of].to_numpy().reshape(5, 5, 5)

    def variance(kept: set[int]) -> float:
        """Variance of the mean over all numbers except ``kept``."""
        g, w = f, np.ones(())
        for k in (2, 1, 0):
            g = g if k in kept else np.tensordot(g, weights, (k, 0))
        for _ in kept:
            w = np.multiply.outer(w, weights)
        return float((w * g * g).sum() - (w * g).sum() ** 2)

    whole = variance({0, 1, 2})
    first = [variance({k}) for k in range(3)]
    total = [whole - variance({0, 1, 2} - {k}) for k in range(3)]
    pairs = [variance({i, j}) - first[i] - first[j] for i, j in ((0, 1), (0, 2), (1, 2))]
    return np.array([*first, *total, *pairs]) / whole


@pytest.mark.slow
def test_the_indices_of_a_guides_travel_lie_inside_their_intervals() -> None:
    """The distance that the guide of example 8.3 slides, as a function of the friction, length and radius of its guide. Quadrature
    gives the true indices. The share of intervals that contain the true index is at least the stated probability, less three
    standard deviations for eight seeds. The nine intervals of a seed are correlated, so the test counts them as three."""
    run: dict[str, Any] = {"until": 1.0, "every": 0.05}
    true, held = by_quadrature("double_pendulum", GUIDE, TRAVEL, **run), []
    for seed in range(8):
        s = trunnion.sweep("double_pendulum", sample=GUIDE, count=32, seed=seed, sampling="saltelli", reductions=TRAVEL, **run)
        (found,) = s.indices()
        n = numbers(found)
        held.append((n[:, 1] <= true + 1e-9) & (true - 1e-9 <= n[:, 2]))
        assert found.missing == {}
    assert np.mean(held) >= 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / 24)


def test_cases_that_fail_are_reported_and_widen_the_intervals_and_failing_has_indices_of_its_own() -> None:
    cases = sampled(scene(), dict.fromkeys(THREE, (-np.pi, np.pi)), 512, 2, "saltelli")
    whole = indices_of(cases, [OF], table(cases, ishigami))
    some = indices_of(cases, [OF], table(cases, ishigami, lambda x: x[:, 1] > 3.0))
    assert (len(whole), len(some)) == (1, 2)
    x = cases.values(0, cases.count)
    assert some[0].missing == {"jammed": int((x[:, 1] > 3.0).sum())}
    assert "no value" in some[0].notes[0]
    a, b = numbers(whole[0]), numbers(some[0])
    assert ((b[:, 2] - b[:, 1]) > (a[:, 2] - a[:, 1])).mean() > 0.8
    seen = ishigami(x[x[:, 1] <= 3.0])
    for fill in (seen.min(), seen.mean(), seen.max()):
        filled = table(cases, lambda x, v=fill: np.where(x[:, 1] > 3.0, v, ishigami(x)))  # type: ignore[misc]
        c = numbers(indices_of(cases, [OF], filled)[0])
        assert ((b[:, 1] <= c[:, 1] + 1e-12) & (c[:, 2] - 1e-12 <= b[:, 2])).all()
    failing = numbers(some[1])
    assert some[1].of == "failed"
    assert failing[[1, 4], 0] == pytest.approx(1.0, abs=1e-9)  # the second number alone decides whether a case fails
    assert failing[:, 0][[0, 2, 3, 5]] == pytest.approx(0.0, abs=1e-9)
    most = indices_of(cases, [OF], table(cases, ishigami, lambda x: x[:, 1] > -3.1))
    assert most[0].first[0].value is None
    assert "no index can be estimated" in most[0].notes[0]


def test_constant_results_and_samples_that_are_not_crossed_have_no_indices() -> None:
    cases = sampled(scene(), dict.fromkeys(THREE, (0, 1)), 64, 0, "saltelli")
    (flat,) = indices_of(cases, [OF], table(cases, lambda x: np.full(len(x), 7.0)))
    assert (flat.first[0].value, flat.notes) == (None, ("the result does not vary",))
    latin = sampled(scene(), dict.fromkeys(THREE, (0, 1)), 64)
    with pytest.raises(SceneError, match="crossed"):
        indices_of(latin, [OF], table(latin, ishigami))
    with pytest.raises(SceneError, match="not in the table"):
        indices_of(cases, [OF], table(cases, ishigami), ["final:y"])


def test_the_command_reports_and_draws_what_the_functions_give(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    import json

    words = ["sweep", "double_pendulum", *(w for p, (a, b) in GUIDE.items() for w in ("--sample", f"{p}={a}:{b}")), "--count", "32",
             "--sampling", "saltelli", "--reduce", TRAVEL, "--until", "0.2", "--every", "0.05"]  # fmt: skip
    s = trunnion.sweep("double_pendulum", sample=GUIDE, count=32, sampling="saltelli", reductions=TRAVEL, until=0.2, every=0.05)
    assert main([*words, "--json", "--above", f"{TRAVEL}=1.9 m", "--plot", str(tmp_path / "i.png")]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["indices"] == [i.document() for i in s.indices()]
    assert told["spreads"] == [x.document() for x in s.spreads(above={TRAVEL: [1.9]})]
    latin = [*words[: words.index("saltelli")], "latin"]
    assert main([*latin, "--reduce", TRAVEL, "--until", "0.2", "--plot", str(tmp_path / "s.svg")]) == 0
    assert "lie below" in capsys.readouterr().out
    assert (tmp_path / "i.png").stat().st_size > 10_000
    assert f"{TRAVEL} (m)" in (tmp_path / "s.svg").read_text()
    assert main(["sweep", "double_pendulum", "--vary", "joints.guide.friction.mu=0.1", "--plot", str(tmp_path / "g.png")]) == 2
    assert "sample" in capsys.readouterr().err
