"""An FMU reproduces corners and jumps of its signals, also in hosts that make the steps themselves. An input that begins late keeps
its start value until it begins."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description

import trunnion
from tests.fmu.exported_fmus import FOLDER
from tests.fmu.fmpy_host import Host
from tests.fmu.model_exchange.model_exchange_host import run_me
from trunnion.fmu.scene_export import export
from trunnion.scene import scene_from_dict

UNTIL, BEGIN = 2.0, 0.5
LOADS = {
    "pulses": {"pulse": {"peak": 9.0, "base": -1.0, "begin": 0.2, "duration": 0.15, "period": 0.4}},
    "tops": {"harmonic": {"amplitude": 9.0, "frequency": 1.3}, "limit": {"upper": 7.0, "lower": -7.5}},
    "fading": {"expression": "F*sin(2*pi*1.7 Hz*t)*exp(-t/0.5 s)"},
    "late": {"input": "force"},
}


def scene(moved: bool = True, **late: object) -> trunnion.Scene:
    """A block with friction for every load and, if ``moved``, an arm that follows an input."""
    rub = {"mu": 0.3, "half_width": 0.01, "half_height": 0.01, "half_length": 0.5}
    rail = {"type": "prismatic", "axis": "x", "inboard": "ground", "pin": "outboard", "friction": rub}
    joints = {name: {**rail, "outboard": f"b_{name}", "effort": load} for name, load in (LOADS | late).items()}
    arm = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "arm", "drive": {"input": "angle"}}
    body = {"mass": 2.0, "inertia": [0.1, 0.1, 0.1]}
    inputs = {"force": {"unit": "N", "start": 1.0, "begin": BEGIN}}
    inputs |= {"angle": {"start": 0.2, "bandwidth": 20.0, "begin": BEGIN}} if moved else {}
    joints |= {"hip": arm} if moved else {}
    return scene_from_dict({"name": "signals", "bodies": {j["outboard"]: body for j in joints.values()}, "joints": joints,
                            "inputs": inputs, "parameters": {"F": "12 N"}})  # fmt: skip


@cache
def made(kind: str) -> Path:
    file = FOLDER / f"signals-{kind}.fmu"
    export(scene(moved=kind == "cs"), file, kind=kind, kernel="parts")
    return file


@cache
def expected() -> trunnion.Result:
    """The run of a scene in which a jump replaces the late input."""
    jump = {"step": {"start": 1.0, "end": 8.0, "begin": BEGIN}}
    return trunnion.simulate(scene(late=jump), until=UNTIL, every=0.1, rtol=1e-11, kernel="parts")


NAMES = [f"{name}.q[1]" for name in LOADS]


def followed(t: np.ndarray) -> np.ndarray:
    """A motion that closes a gap of 0.5 with critical damping from BEGIN on."""
    late = 20.0 * np.maximum(t - BEGIN, 0.0)
    return np.asarray(0.7 - 0.5 * (1.0 + late) * np.exp(-late))


def test_coarse_communication_steps_pass_every_jump_and_a_late_input_counts_from_its_beginning() -> None:
    host = Host(made("cs"), solver__tolerance=1e-11)
    host.set(force=8.0, angle=0.7)
    t, run = np.linspace(0.0, UNTIL, 6), expected()
    for k in range(5):
        host.fmu.doStep(0.4 * k, 0.4)
        assert host.get(*NAMES) == pytest.approx([run[n][4 * (k + 1)] for n in NAMES], abs=1e-9)
        assert host.get("hip.q[1]")[0] == pytest.approx(followed(t)[k + 1], abs=1e-12)


def test_an_input_that_changes_again_before_its_beginning_counts_with_its_last_value() -> None:
    host = Host(made("cs"), solver__tolerance=1e-11)
    for k, force in enumerate([99.0, -50.0, 8.0, 8.0]):
        host.set(force=force, angle=0.7)
        host.fmu.doStep(0.2 * k, 0.2)
    assert host.get("late.q[1]")[0] == pytest.approx(expected()["late.q[1]"][8], abs=1e-9)
    assert host.get("hip.q[1]")[0] == pytest.approx(followed(np.array([0.8]))[0], abs=1e-12)


@pytest.mark.slow
def test_an_importer_s_steps_end_at_jumps_of_periodic_signals() -> None:
    got, _, wrong = run_me(made("me"), UNTIL, NAMES, start_values={"force": 8.0})
    assert not wrong
    rows = [int(np.argmin(np.abs(got["time"] - t))) for t in np.linspace(0.0, UNTIL, 21)]
    for n in NAMES:
        assert got[n][rows] == pytest.approx(expected()[n], abs=3e-5), n


def test_numbers_that_move_jumps_and_corners_are_no_parameters_of_the_fmu() -> None:
    names = {v.name for v in read_model_description(made("cs")).modelVariables}
    given = {"joints.pulses.effort.pulse.peak", "joints.pulses.effort.pulse.base", "parameters.F"}
    fixed = {f"joints.pulses.effort.pulse.{n}" for n in ("begin", "duration", "period")}
    fixed |= {f"joints.tops.effort.{n}" for n in ("harmonic.amplitude", "harmonic.frequency", "limit.upper")}
    assert given <= names
    assert not fixed & names
    host = Host(made("cs"), parameters__F=0.0)
    host.fmu.doStep(0.0, 1.0)
    assert host.get("fading.q[1]")[0] == 0.0


def test_rates_of_a_late_input_matter_only_after_its_beginning() -> None:
    host = Host(made("cs"))
    for k, answers in enumerate((0.0, 1.0)):
        host.set(force=8.0, angle=0.7)
        host.fmu.doStep(0.4 * k, 0.4)
        found = host.fmu.getDirectionalDerivative([host.reference["late.qdd[1]"]], [host.reference["force"]], [1.0])
        assert found[0] == pytest.approx(0.5 * answers), k
