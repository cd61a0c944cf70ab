"""Bounded steps in exports give the engine's numbers. The bounds are parameters, and the host sees overruns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.fmu.fmpy_host import Host
from tests.fmu.sources.c_library_build import Loaded, columns
from trunnion.fmu.c_library.library_files import library
from trunnion.fmu.scene_export import Export, export
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.settings.realtime_steps import most_operations, work_of

SCENE, STEP, UNTIL = "spherical_pendulum", 1e-3, 1.1
ASKED = {"simulation.realtime": {"step": STEP}}
WANTED = ["pendulum.tip.*", "ball.q*", "ball.friction.*", "energy.residual", "events.count", "realtime.*"]
SAME = 1e-9
"""Allowed difference relative to a column's size: baseline and machine round differently, and events are located to 1e-7 of the
speed unit."""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Export]:
    file = tmp_path_factory.mktemp("bounded") / "ball.fmu"
    return file, export(SCENE, file, overrides=ASKED, outputs=WANTED)


def stepped(host: Host, names: list[str], steps: int) -> np.ndarray:
    """Outputs at the ends of this number of steps."""
    rows = []
    for k in range(steps):
        host.fmu.doStep(k * STEP, STEP)
        rows.append(host.get(*names))
    return np.array(rows)


@pytest.mark.slow
def test_the_fmu_and_the_c_library_step_as_the_engine_does(made: tuple[Path, Export], tmp_path: Path) -> None:
    run = trunnion.simulate(SCENE, until=UNTIL, every=STEP, overrides=ASKED, outputs=WANTED, kernel="compiled")
    plain = Loaded(tmp_path, library(SCENE, ASKED, WANTED, checked=True))
    names, steps = columns(plain.made), round(UNTIL / STEP)
    assert names == run.names[1:]
    assert plain.call("init") == 0
    assert plain.call("start", 0.0) == 0
    rows = []
    for _ in range(steps):
        assert plain.call("step", STEP) == 0
        rows.append(plain.row())
    own = np.column_stack([run[n] for n in names])[1:]
    size = 1.0 + np.abs(own).max(axis=0)
    assert np.all(np.abs(stepped(Host(made[0], stop=UNTIL), names, steps) - own) <= SAME * size)
    assert np.all(np.abs(np.array(rows) - own) <= SAME * size)
    assert own[-1][names.index("events.count")] >= 1
    assert plain.overruns == 0


def test_bounds_of_steps_are_parameters_and_steps_beyond_them_are_reported(made: tuple[Path, Export]) -> None:
    """With a bound of one iteration, the fallback makes all steps. The FMU counts these steps and reports them in an output and in
    the log. Without this bound, the fallback makes no steps."""
    host = Host(made[0], stop=1.0, logging=True)
    host.set(**{"solver.iterations": 1})
    got = stepped(host, ["realtime.overrun", "realtime.overruns"], 20)
    assert np.array_equal(got[:, 1], np.arange(1, 21))
    assert np.all(got[:, 0] > 0)
    assert sum("over its bounds" in text for _, text in host.log) == 20
    calm = Host(made[0], stop=1.0)
    assert stepped(calm, ["realtime.overruns"], 20)[-1, 0] == 0


def test_exports_promise_a_bound_that_steps_keep(made: tuple[Path, Export]) -> None:
    """The test counts operations by the weights of the export, over a run with an event and a run made by the fallback."""
    _, told = made
    for bounds in ({}, {"iterations": 1}):
        over = {"simulation.realtime": {"step": STEP, **bounds}}
        run = trunnion.simulate(SCENE, until=UNTIL, every=STEP, overrides=over, outputs=WANTED, kernel="compiled")
        model = Model(run.scene, WANTED, "compiled")
        work, most, c = work_of(model.kernel), most_operations(run.scene, model.kernel), run.stats.counters
        assert work is not None
        assert most is not None
        assert work.of(c["most_evaluations"], c["most_iterations"], 1.0) <= most
        assert bounds or (most == told.operations and any(f"at most {most:,}" in n for n in told.notes))
