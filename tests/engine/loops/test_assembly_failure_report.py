"""The report on a loop that cannot be closed. It contains the remaining distance and angle, and the joints of the loop, their axes
and their drives."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from trunnion.basics.errors import SceneError
from trunnion.scene.scene_loader import scene_from_dict
from trunnion.simulation.run import simulate


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


def test_a_pivot_out_of_reach_is_reported_with_the_distance_that_is_left() -> None:
    outcome = simulate(linkage(0.5), until=0.01).outcome
    assert outcome.name == "open_loop"
    assert outcome.numbers["distance"] == pytest.approx(0.2, rel=1e-6)
    assert outcome.numbers["angle"] == 0.0
    assert "a gap of 0.2 m remains" in outcome.advice
    for joint in ("base", "pin", "far"):
        assert f"{joint} (revolute, axis z)" in outcome.advice
    assert "driven" not in outcome.advice


def test_the_report_of_an_open_loop_names_the_drive_that_keeps_it_open() -> None:
    drive = {"drive": {"constant": {"rate": 1, "start": "180 deg"}}}
    outcome = simulate(linkage(0.25, base=drive), until=0.01).outcome
    assert outcome.name == "open_loop"
    # the rod must span 0.25 + 0.1 m, but has 0.2 m
    assert outcome.numbers["distance"] == pytest.approx(0.15, rel=1e-6)
    assert "driven: base" in outcome.advice


def test_axes_that_do_not_agree_are_reported_as_an_angle() -> None:
    tilted = {"axis": [0, math.sin(0.1), math.cos(0.1)]}
    side = {"body": "ground", "point": [0.25, 0, 0], "axis": "z"}
    outcome = simulate(linkage(0.25, far={"inboard": side, **tilted}), until=0.01).outcome
    assert outcome.name == "open_loop"
    assert 0.0 < outcome.numbers["angle"] <= 0.1 + 1e-9
    assert "deg remains at" in outcome.advice


def test_rates_that_do_not_agree_are_reported_as_rates() -> None:
    # the linkage is stretched, and its joints cannot turn at this rate
    scene = linkage(0.3, base={"drive": {"constant": {"rate": 1}}})
    scene["joints"]["pin"]["drive"] = {"constant": {"rate": 2}}
    outcome = simulate(scene, until=0.01).outcome
    assert outcome.name == "open_loop"
    assert "m/s" in outcome.advice
    assert "driven: base, pin" in outcome.advice
    scene["joints"]["far"]["drive"] = {"constant": {"rate": 5}}
    with pytest.raises(SceneError, match="leave one of its joints without a drive"):
        simulate(scene, until=0.01)


@pytest.mark.parametrize("digits", [6, 15])
def test_a_linkage_that_moves_only_if_its_dimensions_agree_asks_for_more_digits(digits: int) -> None:
    """In Bennett's linkage, opposite links are equal, and sin(twist)/length is the same for all links. Six digits are too few for
    this condition."""
    twist, length = np.radians([40.0, 75.0]), np.array([0.2, 0.2 * np.sin(np.radians(75.0)) / np.sin(np.radians(40.0))])
    first = 1.1
    last = 2.0 * np.arctan(np.sin((twist[1] + twist[0]) / 2) / np.sin((twist[1] - twist[0]) / 2) / np.tan(first / 2))
    at, axes, places = np.eye(4), [], []
    for turn, a, w in zip((first, last, -first, -last), length[[0, 1, 0, 1]], twist[[0, 1, 0, 1]], strict=True):
        axes.append(at[:3, 2].round(digits)), places.append(at[:3, 3].round(digits))
        c, s, cw, sw = np.cos(turn), np.sin(turn), np.cos(w), np.sin(w)
        at = at @ np.array([[c, -s * cw, s * sw, a * c], [s, c * cw, -c * sw, a * s], [0, sw, cw, 0], [0, 0, 0, 1]])
    assert np.abs(at - np.eye(4)).max() < 1e-12
    names = ("ground", "l0", "l1", "l2", "ground")
    bodies = {n: {"mass": 1, "inertia": [0.01] * 3, "position": places[i + 1].tolist()} for i, n in enumerate(names[1:4])}
    joints = {
        f"j{i}": {"type": "revolute", "axis": axis.tolist(), "inboard": a, "outboard": b, "at": place.tolist()}
        for i, (axis, place, a, b) in enumerate(zip(axes, places, names, names[1:], strict=False))
    }
    joints["j0"]["start"] = {"qd": 2.0}
    run = simulate(scene_from_dict({"schema": 1, "bodies": bodies, "joints": joints}), until=0.5)
    assert run.outcome.name == ("open_loop" if digits == 6 else "done")
    assert run.outcome.ok or "more digits" in run.outcome.advice
