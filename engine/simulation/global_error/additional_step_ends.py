"""Additional step ends in the tighter of two runs. Without additional step ends, both runs would begin with the same steps. The
difference of the runs would then not show the errors of these steps."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from itertools import pairwise

import numpy as np

from trunnion.scene.signals.declaration import Corner
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.results.result import Result
from trunnion.simulation.runtime_interface.simulation_block import Block

APART = 0.41
"""Position of an additional step end within a step of the first run, relative to the step's length."""
FEW = 4
"""If at most this many steps lie between two common step ends, the longest of these steps also gets an additional step end."""
MORE = 0.3
"""Largest number of additional step ends, relative to the first run's number of steps. The longest steps are divided first."""
NEAR = 1e-9
"""Distance, relative to the duration of the run, below which two step ends count as the same."""
CORNERS = ("separation",)
"""Kinds of events at which friction has a kink, although no step ends there."""


def offset_step_ends(model: Model, until: float, run: Result, times: np.ndarray) -> Model:
    """The model of the tighter run, with additional step ends. The additional step ends are at places where both runs would
    otherwise make the same steps: after the start, kinks of signals, and events. times: known step ends of the first run, s."""
    numbers = model.built.numbers
    events = [e.time for e in run.events if e.kind not in CORNERS]
    breaks = numbers.break_times(until)
    marks = np.unique([0.0, *breaks, *(t for t in events if t < until), until])
    marks = marks[np.diff(marks, prepend=-until) > NEAR * until]
    added = [t for _, t in sorted(_inside(marks, times), reverse=True)[: max(1, int(MORE * run.stats.steps))]]
    corners = [e.time for e in run.events if e.kind in CORNERS and 0.0 < e.time < until]
    ends = np.setdiff1d([*added, *corners], breaks)
    if not len(ends):
        return model
    numbers = replace(numbers, breaks=(*numbers.breaks, *(Corner(float(t)) for t in ends)))
    other = copy(model)
    other.built = replace(model.built, numbers=numbers)
    other.block = Block(model.kernel, numbers, np.array(model.block.parameters))
    return other


def _inside(marks: np.ndarray, times: np.ndarray) -> list[tuple[float, float]]:
    """(duration of a step, s; time of the additional step end, s) for the first step after each mark. If two marks have at most FEW
    steps between them, the longest of these steps is included, too."""
    out = []
    for a, b in pairwise(marks):
        ends = np.array([a, *times[(times > a) & (times < b)], b])
        steps = np.diff(ends)
        some = {0, int(np.argmax(steps))} if len(steps) <= FEW else {0}
        out += [(float(steps[i]), float(ends[i] + APART * steps[i])) for i in some]
    return out
