"""The scenario scripts run and show the promised results."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.fmu.systems.scenarios import force_step, motor_and_crank, parameter_study


def test_a_scenario_with_more_friction_reaches_less_far(tmp_path: Path) -> None:
    reach = [r for r, _ in parameter_study.study(tmp_path).values()]
    assert all(a < b for a, b in pairwise(reach))
    assert -1.0 < reach[0] < -0.99


def test_a_force_step_reaches_the_drive_and_not_the_prescribed_motion(tmp_path: Path) -> None:
    calm, hit = force_step.run(tmp_path)
    before, after = calm["time"] < force_step.HIT - 1e-9, calm["time"] > force_step.HIT + 0.0015
    assert np.allclose(calm["guide.q[1]"], hit["guide.q[1]"], atol=1e-9)
    for name in force_step.WANTED[1:]:
        assert np.allclose(calm[name][before], hit[name][before], rtol=1e-9, atol=1e-9)
        assert np.abs(calm[name] - hit[name])[after].max() > 1e-3 * np.abs(calm[name]).max()


def test_two_coupled_fmus_move_as_the_one_mechanism(tmp_path: Path) -> None:
    """The motor gets the load of the previous step. Therefore the error of the coupling is of first order in the step."""
    exact = trunnion.simulate(motor_and_crank.one_scene(), until=0.5, rtol=1e-9)["crank_pivot.q[1]"][-1]
    errors = []
    for step in (2e-3, 1e-3):
        t, q, crank = motor_and_crank.coupled(tmp_path, 0.5, step)[-1]
        assert t == pytest.approx(0.5)
        errors.append((abs(q - exact), abs(crank - q)))
    assert errors[1][0] < 2e-3
    assert errors[1][0] < 0.7 * errors[0][0]
    assert errors[1][1] < 1e-3
