"""An FMU of a hoist lifts, rests and reverses according to the efficiencies of its gear unit. The efficiencies are parameters of
the FMU."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.engine.mechanisms.geared_hoist import Hoist
from tests.fmu.exported_fmus import FOLDER
from tests.fmu.fmpy_host import Host
from trunnion.fmu.scene_export import export

ANGLE = "drum_bearing.q[1]"
SINKING = Hoist(20.0, 0.001, 0.5, 1.1, -15.0, 0.9, 0.6, 0.02, rate=-1.0)


@cache
def made() -> Path:
    file = FOLDER / "hoist.fmu"
    export(SINKING.scene(), file, kind="cs", kernel="parts")
    return file


@pytest.mark.parametrize("changes", [{}, {"forward": 0.5}, {"forward": 0.7, "backward": 0.0, "motor": 0.0, "no_load": 0.0}])
def test_a_hoist_as_an_fmu_moves_as_the_closed_form(changes: dict[str, float]) -> None:
    """At first the load sinks. It comes to rest within a communication step, and then rises or stays."""
    h = replace(SINKING, **changes)
    host = Host(made(), begin=False, solver__tolerance=1e-11)
    paths = {"forward": "box.friction.efficiency", "backward": "box.friction.efficiency_backward",
             "no_load": "box.friction.no_load_torque", "motor": "rotor_bearing.effort"}  # fmt: skip
    for name, path in paths.items():
        host.put(f"joints.{path}", getattr(h, name))
    host.fmu.exitInitializationMode()
    t = np.linspace(0.0, 1.0, 6)
    found = [host.get(ANGLE)[0]]
    for k in range(5):
        host.fmu.doStep(0.2 * k, 0.2)
        found.append(host.get(ANGLE)[0])
    assert found == pytest.approx(h.angles(t), abs=1e-9)
