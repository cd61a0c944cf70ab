"""Comparison of the events that runs of one scene report: kinds, joints and parts at the same times, up to the first marginal
event."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import zip_longest
from math import inf

from trunnion.simulation.results.result import Result

METHODS = ("auto", "rk5", "rk8", "rosenbrock")
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
TIMES = 100.0
"""Allowed difference of an event's time, in multiples of the tolerance and the duration."""
OWN_ERROR = 10.0
"""The run's own error in multiples of the tolerance; an event with a smaller margin is marginal."""


UNLOCATED = "separation"
"""Kind of event that reports a force which nearly vanishes between two steps. Whether a run reports it depends on the length of
these steps."""


def times(r: Result, may: float = 0.0) -> dict[tuple[str, int, str], list[float]]:
    """Times of the events of each kind of each joint, s. Impacts less than ``may`` before their contact comes to rest are left out,
    because their number depends on round-off."""
    rests = [(e.joint, e.part, e.time) for e in r.events if e.kind == "contact_rests"]
    found: dict[tuple[str, int, str], list[float]] = defaultdict(list)
    for e in sorted((e for e in r.events if e.kind != UNLOCATED), key=lambda e: e.time):
        if e.kind == "contact_closed" and any(e.joint == j and e.part == p and 0.0 <= t - e.time <= may for j, p, t in rests):
            continue
        found[e.joint, e.part, e.kind].append(e.time)
    return found


def differences(r: Result, exact: Result, may: float) -> Iterator[tuple[float, str]]:
    """Differences between two lists of events of one kind of one joint. Times may differ by ``may``, s; the order of two events
    within ``may`` may differ."""
    run, other = times(r, may), times(exact, may)
    for what in run.keys() | other.keys():
        name = f"{what[2]} of {what[0]}[{what[1]}]"
        for one, same in zip_longest(run[what], other[what]):
            if one is None or same is None:
                yield one or same or 0.0, f"{name}: only in the {'exact one' if one is None else 'run'}"
                break
            if abs(one - same) > may:
                yield min(one, same), f"{name}: off by {abs(one - same) / may * TIMES:.0f} x rtol x duration"
                break


def difference(r: Result, exact: Result, rtol: float, duration: float, until: float = inf) -> str:
    """The first event of a run at this tolerance that differs from the exact run, or "". Events after a given time, or after the
    first marginal event of either run, are ignored."""
    may = TIMES * rtol * duration
    marginal = [e.time for e in (*r.events, *exact.events) if e.marginal or e.margin < OWN_ERROR * rtol]
    told = [(t, what) for t, what in differences(r, exact, may) if t < min([until, *marginal]) - may]
    return f"{min(told)[1]} at {min(told)[0]:.9g} s" if told else ""
