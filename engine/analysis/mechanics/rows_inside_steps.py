"""Repeats a run and adds rows inside its steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.realtime_steps import bounds_of

PARTS = 6
"""Number of equal parts of a step. Each part ends with a row, so that a polynomial of degree 4 passes through the five rows inside
a step."""
SHORTEST = 1e-9
"""A step that is shorter than this, relative to the duration of the run, gets no rows. It is too short to carry load, and its rows
would coincide."""
GO_ON = (bl.MORE, bl.EVENTS_FULL, bl.ROWS_FULL, bl.OK, bl.NEED_JACOBIAN)


def with_rows_inside_steps(result: Result, names: tuple[str, ...]) -> tuple[Result, np.ndarray]:
    """(the same run with the columns ``names`` (names or patterns) at the times of its rows and at times inside its steps, ends of
    the steps in s).

    The motion is the same bit for bit, because the rows are read from the dense output of the steps.
    """
    used, end = result.settings, float(result.time[-1])
    jams = result.scene.simulation.jams == "impact"
    settings = bl.Settings(used["rtol"], used["method"], **({"step": used["step"]} | bounds_of(result.scene)), through_jams=jams)
    steps = run(Model(result.scene, ("*.q[*]",), used["kernel"]), end, 0.0, settings).time
    steps = steps[np.diff(steps, prepend=-np.inf) > SHORTEST * end]
    inside = np.concatenate([steps[:-1] + k / PARTS * np.diff(steps) for k in range(PARTS)])
    nearest = result.time[np.clip(np.searchsorted(result.time, inside)[:, None] - (1, 0), 0, len(result) - 1)]
    far = np.abs(nearest - inside[:, None]).min(axis=1) > SHORTEST / PARTS * end
    times = np.unique(np.concatenate([result.time, inside[far]]))
    model = Model(result.scene, names, used["kernel"])
    rows = _rows_at(model, settings, times)
    later = np.diff(rows[:, 0], prepend=-np.inf) > 0.0  # times within round-off of an event get the event's row
    return replace(result, data=rows[later], columns=tuple(model.columns)), steps


def _rows_at(model: Model, settings: bl.Settings, times: np.ndarray) -> np.ndarray:
    """Rows (times × 1 + columns) of a run at these times. The first time is the start of the run. If the run ends early, there are
    fewer rows."""
    block, end = model.block, float(times[-1])
    block.configure(settings)
    rows, buffer = [np.zeros(block.width)], np.zeros((1, block.width))
    if block.assemble() != 1 or model.begin(settings, 0.0, end, np.inf, rows[0]) != bl.OK:
        return np.zeros((0, block.width))
    block = model.block
    for t in times[1:]:
        status: int = bl.MORE
        while status in GO_ON:
            status, _ = block.advance(t, 1000, buffer)
            if status == bl.NEED_JACOBIAN:
                model.kernel.jacobian()
                block.attach_jacobian()
            block.take_events()
        row = np.zeros(block.width)
        if status != bl.DONE or block.row(row) != bl.OK:
            break
        rows.append(row)
    return np.array(rows)
