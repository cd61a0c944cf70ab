"""Invalid settings are refused before anything runs. The error explains the mistake."""

from __future__ import annotations

import numpy as np
import pytest

from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.scene import load_scene
from trunnion.simulation.run import Model, simulate


def test_every_wrong_setting_is_reported_at_once() -> None:
    with pytest.raises(SceneError) as caught:
        simulate("simple_pendulum", until=-1.0, every=-0.1, rtol=1.0, method="euler", step=-1e-3)
    assert [p.where for p in caught.value.problems] == ["until", "every", "rtol", "step", "method"]
    assert all(p.what and p.hint for p in caught.value.problems)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("until", np.nan),
        ("rtol", np.nan),
        ("every", np.nan),
        ("step", np.nan),
        ("until", np.inf),
        ("rtol", 0.0),
    ],
)
def test_settings_that_are_no_numbers_are_refused(name: str, value: float) -> None:
    with pytest.raises(SceneError):
        simulate("simple_pendulum", **({"until": 0.1, "max_steps": 20} | {name: value}))


def test_a_state_that_cannot_be_evaluated_is_an_error() -> None:
    model = Model(load_scene("simple_pendulum"), ("pivot*",))
    with pytest.raises(SimulationError):
        evaluate(model, {"pivot": [np.nan]}, {})


@pytest.mark.parametrize("q", [{"pivott": [1.0]}, {"pivot": [1.0, 2.0]}])
def test_a_state_of_other_joints_is_refused(q: dict) -> None:
    with pytest.raises((KeyError, ValueError)):
        evaluate(Model(load_scene("simple_pendulum"), ("pivot*",)), q, {})
