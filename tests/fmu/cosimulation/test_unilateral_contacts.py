"""An FMU of a bouncing block lands between communication points, and its restitution is a parameter."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.unilateral.test_geneva_locks import LockedGeneva
from tests.engine.unilateral.test_slots_with_play import Geneva
from tests.engine.unilateral.unilateral_scenes import G, body, scene
from tests.fmu.exported_fmus import FOLDER
from tests.fmu.fmpy_host import Host
from trunnion.fmu.scene_export import export
from trunnion.simulation.run import simulate


def test_a_block_as_an_fmu_bounces_as_the_closed_form() -> None:
    fall = {"type": "prismatic", "inboard": "ground", "outboard": "block", "axis": [0, 0, 1], "start": {"q": 1.0}}
    table = {"type": "point_on_plane", "inboard": "ground", "outboard": "block", "axis": [0, 0, 1]}
    table["unilateral"] = {"restitution": 0.5, "starts": "open"}
    file, e = FOLDER / "bouncing_block.fmu", 0.6
    export(scene({"block": body(2.0, 0.1)}, {"fall": fall, "table": table}), file, kind="cs", kernel="parts")
    host = Host(file, begin=False, solver__tolerance=1e-10)
    host.put("joints.table.unilateral.restitution", e)
    host.fmu.exitInitializationMode()
    first = np.sqrt(2.0 / G)
    hits = first + 2 * first * np.cumsum([0.0, *(e ** np.arange(1, 60))])
    for k in range(30):
        host.fmu.doStep(0.1 * k, 0.1)
        t = 0.1 * (k + 1)
        n = int(np.searchsorted(hits, t))
        since, speed = (t - hits[n - 1], G * first * e**n) if n else (t, 0.0)
        gap = 0.0 if n == len(hits) else speed * since - G * since**2 / 2 + (1.0 if n == 0 else 0.0)
        assert abs(host.get("table.gap")[0] - gap) < 1e-8


def test_a_geneva_wheel_as_an_fmu_turns_as_in_a_run() -> None:
    g, file = Geneva(np.random.default_rng(3)), FOLDER / "geneva.fmu"
    export(g.scene(), file, kind="cs", kernel="parts")
    host = Host(file, solver__tolerance=1e-10)
    for k in range(10):
        host.fmu.doStep(0.05 * k, 0.05)
    r = simulate(g.scene(), until=0.5, rtol=1e-10, kernel="parts")
    assert host.get("pivot.q[1]")[0] == pytest.approx(r["pivot.q[1]"][-1], abs=1e-8)
    assert r["pivot.q[1]"][-1] - g.rest > 0.5


def test_a_locked_geneva_wheel_as_an_fmu_stays_at_its_horn() -> None:
    g, file = LockedGeneva(0), FOLDER / "locked_geneva.fmu"
    export(g.scene(), file, kind="cs", kernel="parts")
    host = Host(file, solver__tolerance=1e-10)
    for k in range(6):
        host.fmu.doStep(0.05 * k, 0.05)
    assert host.get("pivot.q[1]")[0] == pytest.approx(g.angle_at_horn(), abs=1e-12)
    assert host.get("horn0high.contact[1].normal_force")[0] == pytest.approx(g.force_at_horn(), rel=1e-8)
