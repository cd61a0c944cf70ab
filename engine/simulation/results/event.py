"""Events of a run."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan


@dataclass(frozen=True)
class Event:
    """An event of a run.

    Attributes:
        time: time, s.
        kind: kind of event (reference page of events), such as "stick", "slip", "reversal" or "end_stop_engaged".
        joint: name of the joint.
        part: number of its sliding pair or freedom, from 1.
        before: contact angles before the event, rad.
        after: contact angles after it, rad.
        turn: rotation of each contact's normal, rad.
        margin: change of the deciding quantity that would change the decision (relative: friction over capacity, speed over the
            speed scale); NaN for events of time stepping.
        marginal: whether the margin is below the run's own error, or the time is unknown: at another tolerance the decision may
            differ.
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
