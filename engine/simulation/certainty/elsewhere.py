"""Where the tighter of two runs ends steps that the other does not: their errors would else be the same there, and nothing be seen of them."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from itertools import pairwise

import numpy as np

from engine.simulation.block import Block
from engine.simulation.model import Model
from engine.simulation.result import Result

APART = 0.41
"""Part of a step of the first run at which the tighter one ends another."""
FEW = 4
"""Steps between two places at which both runs end steps: along more, they go apart by themselves."""
MORE = 0.3
"""Of the first run's steps: no more are added so, in the longest first."""
NEAR = 1e-9
"""Part of the run between two ends that are one."""
CORNERS = ("separation",)
"""Events at which no step ends, though friction has a kink there."""


def elsewhere(model: Model, until: float, run: Result, times: np.ndarray) -> Model:
    """The model of the tighter run: the same, but for ends of steps inside steps of the first run that both would make alike, between
    kinks of signals, events and the start, and at corners that no step ends at. times: ends of its steps, s, as far as they are known."""
    numbers = model.built.numbers
    events = [e.time for e in run.events if e.kind not in CORNERS]
    marks = np.unique([0.0, *(t for t in numbers.breaks if t < until), *(t for t in events if t < until), until])
    marks = marks[np.diff(marks, prepend=-until) > NEAR * until]
    added = [t for _, t in sorted(_inside(marks, times), reverse=True)[: max(1, int(MORE * run.stats.steps))]]
    corners = [e.time for e in run.events if e.kind in CORNERS and 0.0 < e.time < until]
    ends = np.unique([*added, *corners])
    known = np.unique([*numbers.breaks, *ends])
    if len(known) == len(numbers.breaks):
        return model
    numbers = replace(numbers, breaks=tuple(float(t) for t in known))
    other = copy(model)
    other.built = replace(model.built, numbers=numbers)
    other.block = Block(model.kernel, numbers, np.array(model.block.parameters))
    return other


def _inside(marks: np.ndarray, times: np.ndarray) -> list[tuple[float, float]]:
    """(length of a step, s; where the tighter run ends another in it) of the first step behind each mark, and of the longest step
    of stretches of few."""
    out = []
    for a, b in pairwise(marks):
        ends = np.array([a, *times[(times > a) & (times < b)], b])
        steps = np.diff(ends)
        some = {0, int(np.argmax(steps))} if len(steps) <= FEW else {0}
        out += [(float(steps[i]), float(ends[i] + APART * steps[i])) for i in some]
    return out
