"""Cost as a function of size. The exponents agree with the numbers, and the families agree with their description."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from tests.benchmarks.speed import cost_growth as measuring
from tests.benchmarks.speed.cost_growth import (
    Family,
    Size,
    frictional_chain,
    growth_exponent,
    measure_cost_growth,
    write_cost_growth,
)


def test_the_exponent_is_that_of_a_power_law() -> None:
    values = [(n, 3e-6 * n**1.5) for n in (1, 2, 4, 8, 16)]
    assert growth_exponent(values) == pytest.approx(1.5)
    flat_start = [(1, 1.0), (2, 1.0), (4, 1.0), (8, 8.0), (16, 16.0), (32, 32.0)]
    assert growth_exponent(flat_start) == pytest.approx(1.0)  # the overhead of small sizes is not growth


def test_n_joints_of_the_rubbing_chain_have_friction() -> None:
    for n in (1, 5):
        assert sum(j.friction is not None for j in frictional_chain(n).joints.values()) == n


@pytest.mark.slow
def test_every_family_is_measured_drawn_and_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measuring, "CHAIN", 4)
    families = measure_cost_growth(repeats=1, largest=8)
    assert [f.name for f in families] == ["bodies", "friction joints", "loops", "cases"]
    assert all(s.minimum > 0 for f in families for s in f.sizes)
    names = [p.name for p in write_cost_growth(families, tmp_path)]
    assert names == ["scaling.svg", "scaling.png", "scaling.csv"]
    lines = [x for x in (tmp_path / "scaling.csv").read_text().splitlines() if not x.startswith("#")]
    assert len(list(csv.DictReader(lines))) == sum(len(f.sizes) for f in families)


def test_a_family_without_build_times_shows_none() -> None:
    import math

    assert math.isnan(Family("cases", "", (Size(1, 1.0, 1.0, 0.0), Size(2, 2.0, 2.0, 0.0))).build_exponent)
