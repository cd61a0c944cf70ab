"""A loop that cannot be closed is told with the distance and angle it stays open by, its joints, their axes and its drives."""

from __future__ import annotations

import math
from typing import Any

import pytest

from engine.basics.problems import SceneError
from engine.simulation.run import simulate


def linkage(reach: float, far: dict[str, Any] | None = None, base: dict[str, Any] | None = None) -> dict[str, Any]:
    """A crank of 0.1 m and a rod of 0.2 m, from the ground to a pivot at ``reach`` along x."""

    def bar(length: float) -> dict[str, Any]:
        return {"mass": 1, "inertia": [0, 0.1, 0.1], "points": {"end": [length, 0, 0]}}

    side = {"body": "ground", "point": [reach, 0, 0]}
    return {
        "bodies": {"crank": bar(0.1), "rod": bar(0.2)},
        "joints": {
            "base": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "crank", **(base or {})},
            "pin": {"type": "revolute", "axis": "z", "inboard": "crank.end", "outboard": "rod"},
            "far": {"type": "revolute", "axis": "z", "inboard": side, "outboard": "rod.end", **(far or {})},
        },
    }


def test_a_pivot_out_of_reach_is_told_with_the_distance_that_is_left() -> None:
    outcome = simulate(linkage(0.5), until=0.01).outcome
    assert outcome.name == "open_loop"
    assert outcome.numbers["distance"] == pytest.approx(0.2, rel=1e-6)
    assert outcome.numbers["angle"] == 0.0
    assert "0.2 m stay open" in outcome.advice
    for joint in ("base", "pin", "far"):
        assert f"{joint} (revolute, axis z)" in outcome.advice
    assert "driven" not in outcome.advice


def test_what_a_drive_keeps_open_is_told_with_the_drive() -> None:
    drive = {"drive": {"constant": {"rate": 1, "start": "180 deg"}}}
    outcome = simulate(linkage(0.25, base=drive), until=0.01).outcome
    assert outcome.name == "open_loop"
    assert outcome.numbers["distance"] == pytest.approx(0.15, rel=1e-6)  # 0.25 + 0.1 − 0.2
    assert "driven: base" in outcome.advice


def test_axes_that_do_not_agree_are_told_as_an_angle() -> None:
    tilted = {"axis": [0, math.sin(0.1), math.cos(0.1)]}
    side = {"body": "ground", "point": [0.25, 0, 0], "axis": "z"}
    outcome = simulate(linkage(0.25, far={"inboard": side, **tilted}), until=0.01).outcome
    assert outcome.name == "open_loop"
    assert 0.0 < outcome.numbers["angle"] <= 0.1 + 1e-9
    assert "deg stay open" in outcome.advice


def test_rates_that_do_not_agree_are_told_as_rates() -> None:
    scene = linkage(0.3, base={"drive": {"constant": {"rate": 1}}})  # stretched, so that its joints cannot turn so
    scene["joints"]["pin"]["drive"] = {"constant": {"rate": 2}}
    outcome = simulate(scene, until=0.01).outcome
    assert outcome.name == "open_loop"
    assert "m/s" in outcome.advice
    assert "driven: base, pin" in outcome.advice
    scene["joints"]["far"]["drive"] = {"constant": {"rate": 5}}
    with pytest.raises(SceneError, match="leave one of its joints without a drive"):
        simulate(scene, until=0.01)
