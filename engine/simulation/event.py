"""What happens at an instant of a run, as results tell it."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan


@dataclass(frozen=True)
class Event:
    """An event of a run.

    kind: "reversal" (sliding turned round: the contact normal jumps, a possible impact), "stop_on", "stop_off", …; time, s;
    joint: its name; part: which of its sliding pairs (from 1). before, after: contact angles, rad; turn: angle by which each
    contact's normal turned, rad. margin: by how much what decides it would have to be otherwise for something else to happen, in
    its own unit (friction over what holds, speed over the unit of speed); not a number where steps of impulses made it. marginal:
    that is less than the run's own error, or its time is not known, so that another tolerance may tell otherwise.
    """

    time: float
    kind: str
    joint: str
    part: int = 1
    before: tuple[float, ...] = ()
    after: tuple[float, ...] = ()
    turn: tuple[float, ...] = ()
    margin: float = nan
    marginal: bool = False
