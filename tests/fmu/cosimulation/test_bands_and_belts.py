"""The belt of an FMU slides and holds as the closed form states. Friction and pretension are parameters of the FMU."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.engine.mechanisms.band_brakes_and_belt_drives import Band, Drive
from tests.fmu.exported_fmus import FOLDER
from tests.fmu.fmpy_host import Host
from trunnion.fmu.scene_export import export

STARTING = Drive(Band(0.3, 0.0, None, 200.0), (0.05, 0.12), 0.4, (0.01, 0.05), (5.0, -1.0), rates=(60.0, 0.0))


@cache
def made() -> Path:
    file = FOLDER / "belt_drive.fmu"
    export(STARTING.scene(), file, kind="cs", kernel="parts")
    return file


@pytest.mark.parametrize("more", [{}, {"mu": 0.2}, {"pretension": 40.0}, {"mu": 0.1, "pretension": 100.0}])
def test_a_belt_drive_as_an_fmu_moves_as_the_closed_form(more: dict[str, float]) -> None:
    """The belt slides at first. With enough friction, the belt begins to hold within a communication step."""
    d = replace(STARTING, band=replace(STARTING.band, **more))
    host = Host(made(), begin=False, solver__tolerance=1e-11)
    for key, value in d.band.keys.items():
        host.put(f"joints.belt.friction.{key}", value)
    host.fmu.exitInitializationMode()
    found = [host.get("on_b.q[1]")[0]]
    for k in range(5):
        host.fmu.doStep(0.2 * k, 0.2)
        found.append(host.get("on_b.q[1]")[0])
    assert found == pytest.approx(d.states(np.linspace(0.0, 1.0, 6))[1], abs=1e-9)
