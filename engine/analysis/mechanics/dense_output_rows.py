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
    used, end = result.settings, float(result.time[-1])
    jams = result.scene.simulation.jams == "impact"
    settings = bl.Settings(used["rtol"], used["method"], **({"step": used["step"]} | bounds_of(result.scene)), through_jams=jams)
    again = run(Model(result.scene, names, used["kernel"]), float(used["until"]), -float(PARTS), settings)
    in_run = again.time <= end
    steps = again.data[1:][in_run[1:]]
    steps = steps[: len(steps) // PARTS * PARTS].reshape(-1, PARTS, again.data.shape[1])
    ends = np.r_[again.time[0], steps[:, -1, 0]]
    long = np.diff(ends) > SHORTEST * end
    rows = np.concatenate([again.data[:1], steps[long].reshape(-1, again.data.shape[1])])
    return replace(result, data=rows, columns=again.columns), np.r_[ends[0], ends[1:][long]]
