"""The integration of tangents (derivatives along a run) solves for the multipliers in C. Its results equal the results of the
Python solver."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion
from trunnion.analysis.sensitivities import tangent_integration

ROUND_OFF = 1e-10
"""Allowed difference relative to the largest derivative: multipliers converge to 1e-13, and events amplify the difference."""
CASES = {
    "a ball that comes to rest": ("spherical_pendulum", ["joints.ball.friction.mu", "gravity[3]"], "ball.qd[2]", 2.0),
    "a loop with a driven crank": ("crank_slider", ["joints.slider_pin.friction.mu"], "slider_pin.friction.torque[1]", 0.2),
}


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("case", CASES)
def test_c_and_python_find_the_same_multipliers_and_tangents(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, parameters, column, until = CASES[case]

    def made() -> trunnion.Sensitivity:
        return trunnion.sensitivity(scene, parameters, [column], until, until / 10, rtol=1e-8)

    in_c = made()
    monkeypatch.setattr(tangent_integration, "REGULAR", 2.0)  # with this limit, no matrix counts as clearly regular
    in_python = made()
    assert np.array_equal(in_c.values, in_python.values)
    assert [e.time for e in in_c.events] == [e.time for e in in_python.events]
    scale = np.abs(in_python.derivatives).max(axis=0)
    assert (np.abs(in_c.derivatives - in_python.derivatives) <= ROUND_OFF * scale).all()


def test_c_needs_no_solution_of_python_in_these_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    monkeypatch.setattr(tangent_integration.HostSolver, "solve", lambda self, *places: asked.append(1) or 0)
    for scene, parameters, column, until in CASES.values():
        trunnion.sensitivity(scene, parameters, [column], until, until / 10, rtol=1e-8)
    assert not asked
