"""Pairs of corresponding events in two runs of the same scene. Events correspond if they have the same kind, joint and part and the
same position in the order of time."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from math import inf

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.simulation.results.event import Event

REPORTED = ("separation", "contact_jump")
"""Kinds of events that are only reported and do not affect the motion."""
Kind = tuple[str, str, int]
Timed = tuple[float, int]
"""Time of an event, s, and index of the event in the run."""


@dataclass(frozen=True)
class Pairs:
    """Paired events.

    Attributes:
        times: {index of an event in the first run: (time in the first run, time in the other run)}, s.
        alone: time of the first event that occurs in only one of the runs, s; infinite if there is none.
        about: description of the event at the time ``alone``.
    """

    times: dict[int, tuple[float, float]]
    alone: float = inf
    about: str = ""


def pair_events(run: Sequence[Event], other: Sequence[Event], near_end: float) -> Pairs:
    """Pair the events of two runs. near_end: time, s; later events may lack a counterpart, because the other run may end before
    these events."""
    mine, theirs = _by_kind(run), _by_kind(other)
    times: dict[int, tuple[float, float]] = {}
    alone: list[tuple[float, str]] = []
    for kind in mine.keys() | theirs.keys():
        both, a, b = _align([(run[i].time, i) for i in mine[kind]], [(other[j].time, j) for j in theirs[kind]])
        times |= {i: (t, u) for (t, i), (u, _) in both}
        if kind[0] not in REPORTED:
            what = f"{kind[0].replace('_', ' ')} of {kind[1]} in"
            alone += [(t, f"{what} this run only") for t, _ in a] + [(t, f"{what} the tighter run only") for t, _ in b]
    return Pairs(times, *min((x for x in alone if x[0] < near_end), default=(inf, "")))


def _align(a: list[Timed], b: list[Timed]) -> tuple[list[tuple[Timed, Timed]], list[Timed], list[Timed]]:
    """(pairs, rest of a, rest of b) for two lists in the order of time. An element of the longer list has no partner if its
    successor is nearer to the candidate in the other list."""
    pairs: list[tuple[Timed, Timed]] = []
    alone: tuple[list[Timed], list[Timed]] = ([], [])
    i = j = 0
    while i < len(a) and j < len(b):
        apart, more = abs(a[i][0] - b[j][0]), (len(a) - i) - (len(b) - j)
        if more > 0 and abs(a[i + 1][0] - b[j][0]) < apart:
            alone[0].append(a[i])
            i += 1
        elif more < 0 and abs(a[i][0] - b[j + 1][0]) < apart:
            alone[1].append(b[j])
            j += 1
        else:
            pairs.append((a[i], b[j]))
            i, j = i + 1, j + 1
    return pairs, [*alone[0], *a[i:]], [*alone[1], *b[j:]]


def _by_kind(events: Sequence[Event]) -> defaultdict[Kind, list[int]]:
    out: defaultdict[Kind, list[int]] = defaultdict(list)
    for i in sorted(range(len(events)), key=lambda i: events[i].time):
        out[events[i].kind, events[i].joint, events[i].part].append(i)
    return out
