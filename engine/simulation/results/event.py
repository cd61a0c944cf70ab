"""Events of a run."""

from __future__ import annotations

from math import nan

from trunnion.basics.lazy_data_classes import dataclass


@dataclass(frozen=True)
class Event:
    """An event of a run.

    Attributes:
        time: time, s.
        kind: kind of event (reference page of events), such as "stick", "slip", "reversal" or "end_stop_engaged".
        joint: name of the joint.
        part: number of the joint's friction pair or freedom, from 1.
        before: contact angles before the event, rad.
        after: contact angles after the event, rad.
        turn: rotation of each contact's normal, rad.
        margin: smallest change of the deciding quantity that would change the decision. A margin of friction
            is divided by the capacity; a margin of speed is divided by the speed scale. NaN for events of time stepping.
        marginal: whether the margin is below the run's own error, or the time is unknown. At another tolerance the decision may
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
