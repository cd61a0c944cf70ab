"""Starts with screws keep the given start values, even if the angle of the screw is many turns away."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

GIVEN = (("base", "top", "guide"), ("base", "top"), ("base", "guide"), ("guide",))
"""Joints with given start values. The screw's angle, and in some cases an arm's, is not given."""


Starts = dict[str, float]


def jack(pitch: float, angle: float, given: tuple[str, ...], digits: int, crank: bool = False) -> tuple[dict[str, Any], Starts]:
    """Two arms of 1 m that rise as a screw pulls in their foot, at `angle` rad from flat. Start values are rounded. With a crank,
    the spindle also drives a rod across. Returns the scene, and its start values if all of them are given."""
    closed = {"base": angle, "top": -2 * angle, "guide": 2 * float(np.cos(angle))}
    starts = {n: round(v, digits) for n, v in closed.items()}
    arm = {"box": [1, 0.05, 0.05], "mass": 5, "center": [0.5, 0, 0], "points": {"end": [1, 0, 0]}}
    block = {"box": [0.05, 0.05, 0.05], "mass": 1}
    spindle = {"cylinder": {"radius": 0.01, "length": 1, "axis": "x"}, "mass": 1, "points": {"pin": [0.5, 0, 0.1]}}
    joints: dict[str, dict[str, Any]] = {
        "base": {"type": "revolute", "axis": "-y", "inboard": "ground", "outboard": "arm"},
        "top": {"type": "revolute", "axis": "-y", "inboard": "arm.end", "outboard": "arm2"},
        "foot": {"type": "revolute", "axis": "-y", "inboard": "slider", "outboard": "arm2.end"},
        "guide": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "slider"},
        "bearing": {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": "spindle"},
        "nut": {"type": "screw", "axis": "x", "pitch": pitch, "inboard": "spindle", "outboard": "slider"},
    }
    bodies: dict[str, Any] = {"arm": arm, "arm2": arm, "slider": block, "spindle": spindle}
    if crank:
        bodies |= {"rod": {"box": [0.05, 0.5, 0.05], "mass": 0.5, "points": {"end": [0, 0.5, 0]}}, "across": block}
        place = {"body": "ground", "point": [0.5, 0, 0.05]}
        joints |= {
            "pin": {"type": "spherical", "inboard": "spindle.pin", "outboard": "rod"},
            "eye": {"type": "spherical", "inboard": "rod.end", "outboard": "across"},
            "way": {"type": "prismatic", "axis": "y", "inboard": place, "outboard": "across"},
        }
    for n in given:
        joints[n]["start"] = {"q": starts[n]}
    return {"schema": 1, "name": "jack", "bodies": bodies, "joints": joints, "simulation": {"until": 1e-6}}, starts


def moved(r: Result, starts: dict[str, float], given: tuple[str, ...]) -> float:
    """The largest change of a given start value, rad or m."""
    assert r.outcome.ok
    return max(abs(float(r[f"{n}.q[1]"][0]) - starts[n]) for n in given)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize("digits", [12, 7])
def test_a_start_is_kept_whatever_the_pitch_of_a_screw(given: tuple[str, ...], digits: int) -> None:
    for pitch in (1e-4, 5e-3, -5e-3, 1.0):
        for angle in (0.5, 0.05, -1.2):
            scene, starts = jack(pitch, angle, given, digits)
            r = simulate(scene, outputs=["*.q[*]"])
            lever = min(1.0, 2.0 * abs(np.sin(angle)))  # travel of the foot per angle of the arms, m/rad, at most 1
            assert moved(r, starts, given) <= 3 * 10.0**-digits / lever
            turns = float(r["guide.q[1]"][0]) / pitch
            assert abs(float(r["nut.q[1]"][0])) / (2 * np.pi) == pytest.approx(abs(turns), rel=1e-9)


@pytest.mark.parametrize("pitch", [5e-3, -5e-3, 0.1])
def test_a_screw_that_also_drives_a_crank_is_found_as_far_away(pitch: float) -> None:
    given = ("base", "top", "guide")
    scene, starts = jack(pitch, np.pi / 6, given, 9, crank=True)
    assert moved(simulate(scene, outputs=["*.q[*]"]), starts, given) <= 3e-9
