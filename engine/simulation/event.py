"""What happens at an instant of a run, as results tell it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Event:
    """An event of a run.

    kind: "reversal" (sliding turned round: the contact normal jumps, a possible impact), "stop_on", "stop_off", …; time, s;
    joint: its name; part: which of its sliding pairs (from 1). before, after: contact angles, rad; turn: angle by which each
    contact's normal turned, rad.
    """

    time: float
    kind: str
    joint: str
    part: int = 1
    before: tuple[float, ...] = ()
    after: tuple[float, ...] = ()
    turn: tuple[float, ...] = ()
