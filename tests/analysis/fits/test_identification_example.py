"""In the example model, the fit finds the numbers with which the data were made. The model's README agrees with its script."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

import trunnion
from trunnion.analysis.sensitivities.sensitivity import DifferentiatedRuns
from trunnion.scene.library.model_folders import models_dir

FOLDER = models_dir() / "friction_identification"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("identify", FOLDER / "identify.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def found(script: ModuleType) -> trunnion.Fit:
    return script.identify(FOLDER / "measured.csv")


def test_the_truth_lies_within_three_deviations(script: ModuleType, found: trunnion.Fit) -> None:
    assert found.converged
    for name, value in script.TRUTH.items():
        assert abs(found.values[name] - value) < 3 * found.deviation[name]


def test_the_misfit_is_the_noise(script: ModuleType, found: trunnion.Fit) -> None:
    assert found.misfit == pytest.approx(script.NOISE, rel=0.05)  # the misfit of 601 samples varies by 3 %


def test_the_readme_states_the_fitted_values(found: trunnion.Fit) -> None:
    text = (FOLDER / "README.md").read_text()
    assert f"{found.values['joints.pivot.friction.mu']:.5f}" in text
    assert f"{found.values['joints.pivot.damping']:.5f}" in text


def test_the_search_takes_as_few_runs_as_the_readme_states(found: trunnion.Fit) -> None:
    assert "needs fewer than ten runs" in (FOLDER / "README.md").read_text()
    assert found.rounds < 10


MU, DRAG = "joints.pivot.friction.mu", "joints.pivot.damping"


def measured(mu: float, drag: float = 0.02) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Angle of the arm over one second, without noise."""
    r = trunnion.simulate("friction_identification", 1.0, 0.02, rtol=1e-10, overrides={MU: mu, DRAG: drag}, outputs=["pivot.q[1]"])
    return r.time, {"pivot.q[1]": r["pivot.q[1]"]}


def test_a_search_that_would_leave_the_valid_range_stays_inside_it() -> None:
    """The data have almost no friction, and the first guess of friction is high. Without bounds, the first steps of the search
    would give negative friction."""
    time, curves = measured(1e-3)
    found = trunnion.fit("friction_identification", [MU], time, curves, overrides={MU: 0.5})
    assert found.converged
    assert found.values[MU] == pytest.approx(1e-3, rel=1e-5)


def test_a_bound_that_the_data_point_beyond_is_where_the_search_ends() -> None:
    """The assumed dry friction exceeds the friction in the data, so the best drag would be negative. The result is the bound zero,
    although the search also starts at zero."""
    time, curves = measured(0.05, 1e-6)
    found = trunnion.fit("friction_identification", [DRAG], time, curves, overrides={MU: 0.2, DRAG: 0.0})
    assert 0.0 <= found.values[DRAG] < 1e-4


def test_a_trial_that_cannot_be_run_shortens_the_step_and_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    time, curves = measured(0.23)
    whole, tried = DifferentiatedRuns.__call__, []

    def only_near(runs: DifferentiatedRuns, scene: trunnion.Scene, tick: Callable[[], None]) -> trunnion.Sensitivity:
        mu = scene.joints["pivot"].friction.mu
        tried.append(mu)
        if mu > 0.12 and len(tried) < 5:
            raise trunnion.SimulationError("the run ends early: stuck")
        return whole(runs, scene, tick)

    monkeypatch.setattr(DifferentiatedRuns, "__call__", only_near)
    found = trunnion.fit("friction_identification", [MU], time, curves, overrides={MU: 0.1})
    assert found.values[MU] == pytest.approx(0.23, rel=1e-6)
    assert found.notes
    assert all("ends early" in n and "friction.mu = " in n for n in found.notes)


def test_a_parameter_that_changes_nothing_is_named() -> None:
    time, curves = measured(0.23)
    tip = "bodies.arm.points.tip[1]"
    with pytest.raises(trunnion.SceneError, match=r"tip\[1\] changes none"):
        trunnion.fit("friction_identification", [MU, tip], time, curves)
