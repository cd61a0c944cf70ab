"""Derivatives across the instant at which a latch's hook releases its part under load. Too large a force, or a signal that lifts
the hook, causes the release."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.analysis.sensitivities.test_derivatives_along_runs import ACROSS, off
from trunnion import scene_from_dict, sensitivity, simulate
from trunnion.scene.data_classes.scene import Scene

OUTPUTS = ["r.q[1]", "r.qd[1]"]


def thrown(seed: int, lets_go: str, **more: Any) -> Scene:
    """A wheel that is thrown past a hook; a steady torque turns it back onto the hook."""
    rng = np.random.default_rng(seed)
    at, inertia = rng.uniform(0.2, 0.35), rng.uniform(0.15, 0.25)
    back = 0.5 * inertia * 5.0**2 / (at + 0.12)  # the wheel reverses this far beyond the hook
    pressed = float(np.sqrt(2.0 * back * 0.12 * 200.0))  # about the largest force of the hook without a release
    latch: dict[str, Any] = {"at": at, "stiffness": rng.uniform(150.0, 250.0), "damping": rng.uniform(0.0, 0.3)}
    if lets_go == "signal":
        met = 2.0 * (at + 0.12) / 5.0 + np.sqrt(2.0 * 0.12 * inertia / back)  # time at which the wheel is back at the hook
        latch["release"] = {"ramp": {"start": 0.0, "end": 1.0, "duration": 0.02, "begin": met + rng.uniform(0.01, 0.04)}}
    else:
        latch["holds"] = pressed * rng.uniform(0.2, 0.4)
    if lets_go == "tooth":
        latch["pitch"] = rng.uniform(0.06, 0.1)
    joint = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "b", "start": {"qd": 5.0}, "effort": -back} | more
    wheel = {"mass": 1.0, "inertia": [inertia] * 3}
    return scene_from_dict(
        {"schema": 1, "name": "w", "gravity": [0, 0, 0], "bodies": {"b": wheel}, "joints": {"r": joint | {"latch": latch}}}
    )


def names(scene: Scene) -> list[str]:
    """The latch's numbers, the load and a start value."""
    latch = scene.joints["r"].latch
    own = ["release.ramp.begin", "release.ramp.duration"] if latch.holds is None else ["holds"]
    own += ["pitch"] if latch.pitch else []
    return [f"joints.r.latch.{n}" for n in ("at", "stiffness", *own)] + ["joints.r.effort", "joints.r.start.qd"]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("lets_go", ["force", "signal", "tooth"])
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 6))])
def test_derivatives_across_a_release_are_those_of_differences(seed: int, lets_go: str) -> None:
    scene = thrown(seed, lets_go)
    r = simulate(scene, until=0.5)
    assert {"end_stop_engaged", "unlatch"} <= {e.kind for e in r.events}, r.events
    assert off(scene, names(scene), OUTPUTS, 0.5, rows=1) < ACROSS


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("lets_go", ["force", "signal"])
def test_a_shaft_that_rubs_has_derivatives_across_the_release_of_its_latch(lets_go: str) -> None:
    scene = thrown(7, lets_go, friction={"torque": 0.4})
    assert off(scene, [*names(scene)[:3], "joints.r.friction.torque"], OUTPUTS, 0.5, rows=1) < ACROSS


@pytest.mark.default_cases(7)
@pytest.mark.parametrize("seed", range(8))
def test_an_end_stop_is_no_unknown_cause(seed: int) -> None:
    """The stop's force is continuous. Round-off of the contact's instant does not count as a jump."""
    rng = np.random.default_rng(seed)
    stop = {"stiffness": 10 ** rng.uniform(2.0, 6.0), "upper": rng.uniform(0.3, 0.7), "damping": rng.uniform(0.0, 0.4)}
    joint = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "b", "start": {"qd": 3.0}, "end_stops": stop}
    wheel = {"mass": 1.0, "inertia": [0.2] * 3}
    scene = scene_from_dict({"schema": 1, "gravity": [0, 0, 0], "bodies": {"b": wheel}, "joints": {"r": joint}})
    found = sensitivity(scene, ["joints.r.end_stops.stiffness", "joints.r.start.qd"], OUTPUTS, 0.5)
    assert not found.notes
