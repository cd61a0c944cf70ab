"""A host turns a sleeve on its shaft. The sleeve slides while its input changes, and rests when the input rests, although a drive
approaches its input only gradually."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.friction.test_sleeve_with_rotation_drive import LONG, alone, drawn
from tests.fmu.exported_fmus import FOLDER
from tests.fmu.fmpy_host import Host
from trunnion.fmu.scene_export import export
from trunnion.scene.scene_loader import scene_from_text

STEP, STEPS, BEGIN = 0.005, 400, 100
"""Communication step, s; number of these steps, and the step at which the host sets another angle."""
TURN, BANDWIDTH = 0.5, 100.0
"""Angle set by the host, rad; bandwidth, rad/s."""


def rate(t: float) -> float:
    """Rate of a critically damped motion to the angle that the host set, rad/s."""
    since = max(t - BEGIN * STEP, 0.0)
    return TURN * BANDWIDTH**2 * since * np.exp(-BANDWIDTH * since)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("share", [0.2, 0.5])
def test_a_sleeve_that_follows_an_input_starts_and_rests_with_it(share: float) -> None:
    scene = scene_from_text(drawn("{input: turn}", 0.2, share, 0.3) + "inputs: {turn: {unit: rad}}\n")
    file = FOLDER / f"turned-{share}.fmu"
    export(scene, file, flavour="native", outputs=["shaft.q[1]", "shaft.qd[1]", "events.*"])
    host, rows = Host(file), []
    for k in range(STEPS):
        if k == BEGIN:
            host.put("turn", TURN)
        host.fmu.doStep(k * STEP, STEP)
        rows.append([(k + 1) * STEP, *host.get("shaft.q[1]", "shaft.qd[1]", "events.count")])
    time, q, v, count = np.array(rows).T
    assert q == pytest.approx(alone(rate, 0.2, share, 0.3, time)[0], abs=20 * 1e-6 * LONG)
    assert count[BEGIN - 1] == 1.0  # the sleeve has stopped
    assert count[-1] in (2.0, 3.0)  # the sleeve slips; the FMU may report the decay of its motion as a stop
    assert abs(v[-1]) < 1e-20
