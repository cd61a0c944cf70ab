"""Whether runs of one scene tell the same events: kinds, joints and parts at the same instants, up to the first marginal one."""

from __future__ import annotations

from itertools import groupby, zip_longest
from math import inf

from engine.simulation.event import Event
from engine.simulation.result import Result

METHODS = ("auto", "rk5", "rk8", "rosenbrock")
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
TIMES = 100.0
"""Times the tolerance and the duration: so far the time of an event may be off."""
OWN_ERROR = 10.0
"""Times the tolerance: the run's own error, below which a margin is marginal."""


def instants(r: Result) -> list[list[Event]]:
    """The events of a run by instant."""
    return [list(g) for _, g in groupby(sorted(r.events, key=lambda e: e.time), key=lambda e: e.time)]


def told(events: list[Event]) -> set[tuple[str, int, str]]:
    """What is the same in all runs."""
    return {(e.joint, e.part, e.kind) for e in events}


def names(events: list[Event]) -> str:
    """The events of an instant in words."""
    return f"{', '.join(f'{kind} of {joint}[{part}]' for joint, part, kind in sorted(told(events)))} at {events[0].time:.9g} s"


def difference(r: Result, exact: Result, rtol: float, duration: float, until: float = inf) -> str:
    """The first instant of a run at this tolerance that is not as in the exact one, up to a time or to the first instant that is
    marginal in either; empty: there is none."""
    for one, other in zip_longest(instants(r), instants(exact), fillvalue=[]):
        both = one + other
        if both[0].time > until or any(e.marginal or e.margin < OWN_ERROR * rtol for e in both):
            return ""
        if not one or not other:
            return f"{names(both)}: only in the {'run' if one else 'exact one'}"
        if told(one) != told(other):
            return f"{names(one)} for {names(other)}"
        off = abs(one[0].time - other[0].time) / rtol / duration
        if off > TIMES:
            return f"{names(one)}: off by {off:.0f} x rtol x duration"
    return ""
