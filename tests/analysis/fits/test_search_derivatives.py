"""The search computes slopes only at accepted points. Its results equal, to the last bit, the results of a search that computes
slopes at every trial."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.benchmarks.numerical_error.fit_interval_coverage import CASES, Bench
from trunnion.analysis.fits.least_squares_objective import Objective
from trunnion.analysis.fits.model_curves import ModelCurves
from trunnion.basics.json_values import finite


class Everywhere(Objective):
    """A search that computes slopes at every trial."""

    @property
    def least(self) -> float:
        """Infinity: every trial then counts as an improvement."""
        return np.inf

    @least.setter
    def least(self, value: float) -> None:
        pass


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", CASES)
def test_plain_runs_give_the_curves_of_runs_with_slopes_to_the_bit(name: str) -> None:
    curves = Bench(CASES[name]).curves
    values = np.random.default_rng(1).uniform(0.9, 1.1, len(curves.names))
    values *= Bench(CASES[name]).truth
    assert np.array_equal(curves.values(values), curves.slopes(values)[0])


def test_a_trial_that_is_no_better_asks_for_no_slopes_and_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    exact = ModelCurves._exact
    monkeypatch.setattr(ModelCurves, "_exact", lambda self, values: (asked.append(1), exact(self, values))[1])
    found, counts = [], []
    for kind in (Objective, Everywhere):
        bench: Any = Bench(CASES["block on a spring"])
        bench.objective.__class__ = kind
        asked.clear()
        found.append(finite(bench.fitted(6, 0.95).document()))
        counts.append(len(asked))
    assert found[0] == found[1]
    assert counts[0] < counts[1]
