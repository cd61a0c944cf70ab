"""Repeats a run with output rows inside its steps, read from the dense output of the method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.realtime_steps import bounds_of

PARTS = 12
"""Number of equal parts of a step. Each part ends with a row. A step of an accurate method may take half the duration of a contact
with a stiff end stop."""
SHORTEST = 1e-9
"""A step shorter than this value, relative to the duration of the run, gets no rows. The load during this step is negligible, and
the times of its rows would coincide."""


def with_rows_inside_steps(result: Result, names: tuple[str, ...]) -> tuple[Result, np.ndarray]:
    """Repeat a run with rows inside its steps in place of its own rows. Returns (result with the columns ``names``, which are names
    or patterns; ends of the steps, s).

    The motion is bit-identical, because the rows are read from the dense output of the steps.
    """
    used, end = result.settings, float(result.outcome.time)
    jams = result.scene.simulation.jams == "impact"
    settings = bl.Settings(used["rtol"], used["method"], **({"step": used["step"]} | bounds_of(result.scene)), through_jams=jams)
    again = run(Model(result.scene, names, used["kernel"]), float(used["until"]), -float(PARTS), settings)
    rows = again.data[again.time <= end * (1.0 + SHORTEST)]  # times of rows have round-off
    steps = rows[1 : 1 + (len(rows) - 1) // PARTS * PARTS].reshape(-1, PARTS, rows.shape[1])
    ends = np.r_[rows[0, 0], steps[:, -1, 0]]
    long = np.diff(ends) > SHORTEST * end
    kept = [rows[:1], steps[long].reshape(-1, rows.shape[1]), rows[1 + steps.shape[0] * PARTS :]]  # the last step may end later
    data = np.concatenate(kept)
    return replace(result, data=data, columns=again.columns), np.r_[ends[0], ends[1:][long], data[-1, 0]]
