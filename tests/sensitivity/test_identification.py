"""The example model: what it was made with comes back, and its README says what its script says."""

from __future__ import annotations

import importlib.util
from types import ModuleType

import pytest

import engine
from engine.scene.library import models_dir

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
def found(script: ModuleType) -> engine.Fit:
    return script.identify(FOLDER / "measured.csv")


def test_the_truth_lies_within_three_deviations(script: ModuleType, found: engine.Fit) -> None:
    assert found.converged
    for name, value in script.TRUTH.items():
        assert abs(found.values[name] - value) < 3 * found.deviation[name]


def test_the_misfit_is_the_noise(script: ModuleType, found: engine.Fit) -> None:
    assert found.misfit == pytest.approx(script.NOISE, rel=0.05)  # 601 samples: 3 %


def test_the_readme_tells_what_was_found(found: engine.Fit) -> None:
    text = (FOLDER / "README.md").read_text()
    assert f"{found.values['joints.pivot.friction.mu']:.5f}" in text
    assert f"{found.values['joints.pivot.damping']:.5f}" in text
