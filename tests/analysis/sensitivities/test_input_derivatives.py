"""Derivatives of scenes with external actions: inputs as efforts, inputs as motions, tables, and all three together."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from tests.analysis.sensitivities.test_derivatives_along_runs import ACROSS, SMOOTH, off
from trunnion.cli import main
from trunnion.runtime.abi import run_records
from trunnion.scene import scene_from_dict
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.yaml_writer import scene_to_yaml
from trunnion.system.structure.external_value_layout import External

ARM = {"box": [0.6, 0.04, 0.04], "density": 7800, "points": {"pivot": [-0.3, 0, 0], "end": [0.3, 0, 0]}}
RUB = {"mu": 0.1, "radius": 0.008, "half_length": 0.015}
MU, SECOND = "joints.shoulder.friction.mu", "bodies.lower.density"


def arms(shoulder: dict[str, Any], elbow: dict[str, Any], **more: Any) -> Scene:
    """Two arms in series; gravity acts across their axes."""
    joint = {"type": "revolute", "axis": "z"}
    return scene_from_dict({
        "schema": 1, "name": "arms", "gravity": [0, -9.81, 0], "bodies": {"upper": ARM, "lower": ARM},
        "joints": {"shoulder": joint | {"inboard": "ground", "outboard": "upper.pivot", "friction": RUB} | shoulder,
                   "elbow": joint | {"inboard": "upper.end", "outboard": "lower.pivot"} | elbow},
    } | more)  # fmt: skip


TORQUE = {"inputs": {"torque": {"unit": "N*m", "start": 3.0}}}
ANGLE = {"inputs": {"angle": {"unit": "rad", "start": 0.4, "bandwidth": 20.0}}}
TABLE = {"table": {"time": [0.0, 0.1, 0.25, 0.4, 0.6], "value": [0.0, 0.2, 0.1, 0.5, 0.4]}}
FORCES = {"table": {"time": [0.05, 0.15, 0.3], "value": [0.0, 20.0, -5.0]}}
SCENES = {
    "an input is an effort": (arms({"effort": {"input": "torque"}}, {}, **TORQUE), [MU, SECOND, "inputs.torque.start"]),
    "an input is a motion": (arms({}, {"drive": {"input": "angle"}}, **ANGLE), [MU, SECOND, "inputs.angle.start"]),
    "a table is a motion": (arms({}, {"drive": TABLE}), [MU, SECOND]),
    "a table is an effort": (arms({"effort": FORCES}, {}), [MU, SECOND]),
    "all at once": (
        arms({"effort": {"input": "torque"}, "end_stops": {"upper": 0.1, "stiffness": 1e4}, "start": {"qd": 2.0}}, {"drive": TABLE},
             forces={"push": {"type": "force", "on": "lower.end", "force": [FORCES, 0, 0]}}, **TORQUE),
        [MU, SECOND, "inputs.torque.start"],
    ),
}  # fmt: skip


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("what", SCENES)
def test_runs_with_external_actions_have_derivatives(what: str) -> None:
    scene, names = SCENES[what]
    outputs = ["lower.end.position[1]", "shoulder.qd[1]", "elbow.reaction.force[1]"]
    assert off(scene, names, outputs, 0.35) < (ACROSS if what == "all at once" else SMOOTH)  # a stop engages during the run


def test_how_fast_a_motion_follows_an_input_that_stays_does_not_matter() -> None:
    scene, _ = SCENES["an input is a motion"]
    s = trunnion.sensitivity(scene, ["inputs.angle.bandwidth"], ["*.q[*", "*.qd[*"], 0.2)
    assert np.abs(s.derivatives).max() < 1e-15  # the weights of the difference formula add up to round-off


def test_the_kink_of_a_ramp_is_no_event_beside_an_input() -> None:
    """Derivatives are continuous where a drive's acceleration jumps at a fixed time. The result contains no note and no event."""
    ramp = {"ramp": {"start": 0.0, "end": 3.0, "begin": 0.1, "duration": 0.05}}
    scene = arms({"effort": {"input": "torque"}}, {"drive": ramp}, **TORQUE)
    s = trunnion.sensitivity(scene, [SECOND], ["shoulder.q[1]"], 0.3)
    assert not s.notes
    assert not s.events
    assert off(scene, [SECOND], ["shoulder.q[1]"], 0.3) < SMOOTH


def test_the_command_differentiates_by_an_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, names = SCENES["an input is an effort"]
    file = tmp_path / "arms.yaml"
    file.write_text(scene_to_yaml(scene))
    words = ["sensitivity", str(file), "--outputs", "shoulder.q[1]", "--until", "0.1", "--json"]
    assert main([*words, *(w for n in names for w in ("--vary", n))]) == 0
    got = json.loads(capsys.readouterr().out)
    assert np.array_equal(got["derivatives"], trunnion.sensitivity(scene, names, ["shoulder.q[1]"], 0.1).derivatives)


def test_the_mode_of_a_pair_is_read_by_the_names_of_its_record() -> None:
    at = External(tables=1, stops=2, sliders=3)
    x = np.arange(float(at.size))
    mode = at.mode_in(x, 1)
    record = x[at.mode(1) : at.mode(2)].view(run_records.MODE.dtype)[0]
    assert (mode.flag, *mode.direction, mode.tilt) == (record["flag"], *record["direction"], record["tilt"])
    assert mode.flag == x[at.mode(1)]
