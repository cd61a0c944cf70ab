"""Mechanisms from the test suites of other programs, written as scenes, reproduce the numbers that these programs publish."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.models.reference_file_reader import Expected, columns_of, evaluate, load_expected
from trunnion.scene import load_scene
from trunnion.scene.overrides import apply
from trunnion.simulation.run import simulate

FOLDER = Path(__file__).parent / "other_programs"
MECHANISMS = sorted(f.name for f in FOLDER.iterdir())


def difference(mechanism: str, e: Expected) -> float:
    """The number that the scene gives, minus the published number."""
    scene = apply(load_scene(FOLDER / mechanism / "scene.yaml"), dict(e.set))
    until = e.at or 1e-3
    result = simulate(scene, until=until, every=until, outputs=columns_of(e.value))
    assert result.outcome.ok, result.outcome
    return evaluate(e.value, lambda name: float(result[name][-1 if e.at else 0])) - e.expect


@pytest.mark.parametrize("mechanism", MECHANISMS)
def test_the_scene_of_a_mechanism_gives_the_published_numbers(mechanism: str) -> None:
    wrong = {}
    for e in load_expected(FOLDER / mechanism / "reference.yaml"):
        if not abs(off := difference(mechanism, e)) <= e.tolerance:
            wrong[f"{e.value} at {e.at}"] = off
    assert not wrong
