"""The global error of a run from a tighter one of the same scene (METHOD, "Global error")."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from engine.simulation.certainty.kinds import Kinds, differences, kinds
from engine.simulation.certainty.pairing import TOLD, Pairs, paired
from engine.simulation.certainty.stated import Certainty, Promise
from engine.simulation.result import Result
from engine.system.numbers import Numbers

SAFETY = 1.5
"""Errors stated over those found: two runs may come near each other by chance."""
SHARED = 0.15
"""Part of the largest error among the components of a vector that each of them has at least: one alone may pass through zero."""
AHEAD = 0.01
"""Part of the run by which errors are looked for ahead of a row, for they pass through zero in time too."""
RESOLVED = 3e-3
"""Part of the tolerance, of a column's size, below which two runs tell nothing: their first steps may be the same."""
ROUND_OFF = 1e-13
"""Round-off of a column, of the natural size of its unit and of its own: some hundred operations."""
LINEAR = 0.3
"""Largest error of a coordinate or rate, of its scale and size, up to which the tighter run's own is small."""
DECIDED = 1.0
"""Times the error of the state, over its scales: an event with a smaller margin may be decided otherwise."""
TIMED = 2.0
"""Errors of times of events over what those of columns are over differences: each is found once, not in many rows."""
STATE = 0.3
"""Part of the state's error, over the scene's rate, that the time of an event is off by at least."""
WIDER = 2.0
"""Times the error of an event's time: rows so near to it may be before or behind it."""
NEAR_END = 1e-9
"""Part of the run before its end in which events may be missing in one of the two."""


def certainty(run: Result, tighter: Result, numbers: Numbers, correction: float) -> Certainty:
    """The errors of a run from a tighter one at the same times. numbers: scales of the scene; correction: by how much the
    difference of the two is to be enlarged for the tighter run's own error."""
    columns, rows = run.columns, min(len(run), len(tighter))
    k, gap = kinds(columns, numbers), correction * SAFETY
    end, pairs = _paired(run, tighter)
    found = gap * differences(run.data[:rows, 1:], tighter.data[:rows, 1:], k)
    states = _of_state(run, found, k)
    event_errors = _event_errors(run, pairs, gap, states, numbers.rate)
    shift = _shifts(run.time, pairs, event_errors)
    found[np.ix_(shift[:rows] > 0.0, k.jumps)] = 0.0
    found = np.maximum.accumulate(np.nan_to_num(found, posinf=0.0), axis=0)
    promise = _promise(run, tighter, pairs, end, states)
    kept = run.time < promise.until
    floor, error = np.where(k.errs, _floor(run, k), np.nan), np.full((len(run), len(columns)), np.nan)
    here = min(rows, int(kept.sum()))
    error[:here] = np.maximum(_shared(_ahead(found[:here], len(run)), k, floor), floor)
    shift[~kept] = 0.0
    errors = tuple(e if run.events[i].time < promise.until else np.nan for i, e in enumerate(event_errors))
    return Certainty(tuple(c.name for c in columns), tuple(c.unit for c in columns), error, shift, errors, floor, promise)


def _of_state(run: Result, found: np.ndarray, k: Kinds) -> np.ndarray:
    """The largest error of a coordinate or rate over its scale and size, so far, rows."""
    size = np.maximum.accumulate(np.abs(run.data[: len(found), 1:][:, k.states]), axis=0)
    errors = (found[:, k.states] / (k.scale[k.states] + size)).max(axis=1, initial=0.0)
    return np.maximum.accumulate(np.nan_to_num(errors))


def _paired(run: Result, tighter: Result) -> tuple[float, Pairs]:
    """(time up to which both runs went, s; their events paired)."""
    end = min(_end(run), _end(tighter))
    every = paired(run.events, tighter.events, inf)
    apart = max((abs(a - b) for a, b in every.times.values()), default=0.0)
    return end, paired(run.events, tighter.events, end - 10.0 * apart - NEAR_END * end)


def _event_errors(run: Result, pairs: Pairs, gap: float, states: np.ndarray, rate: float) -> list[float]:
    """Errors of the times of the run's events, s: each at least as large as those before, and as what the error of the state at
    that time takes at the scene's rate."""
    rtol = 0.0 if run.settings["step"] else run.settings["rtol"]
    errors, largest = [], ROUND_OFF * run.time[-1] + RESOLVED * rtol / rate
    rows = np.minimum(np.searchsorted(run.time, [e.time for e in run.events]), len(states) - 1)
    for i, row in enumerate(rows):
        if i in pairs.times and run.events[i].kind not in TOLD:
            largest = max(largest, TIMED * gap * abs(pairs.times[i][0] - pairs.times[i][1]))
        errors.append(max(largest, STATE * states[row] / rate))
    for i in reversed(range(len(errors) - 1)):
        if run.events[i].time == run.events[i + 1].time:  # one instant
            errors[i] = max(errors[i], errors[i + 1])
    return errors


def _end(run: Result) -> float:
    return run.outcome.time if not run.outcome.ok else float(run.settings["until"])


def _shifts(times: np.ndarray, pairs: Pairs, errors: Sequence[float]) -> np.ndarray:
    """By how much an event near each row may be earlier or later, s."""
    shift = np.zeros(len(times))
    for i, (mine, other) in pairs.times.items():
        wide = max(WIDER * abs(mine - other), errors[i])
        first, last = np.searchsorted(times, [min(mine, other) - wide, max(mine, other) + wide])
        shift[first:last] = np.maximum(shift[first:last], errors[i])
    return shift


def _floor(run: Result, k: Kinds) -> np.ndarray:
    """What the columns' errors cannot be told below, n."""
    size = np.zeros(k.group.max(initial=-1) + 1)
    np.maximum.at(size, k.group, np.abs(np.nan_to_num(run.data[:, 1:])).max(axis=0, initial=0.0))
    rtol = 0.0 if run.settings["step"] else run.settings["rtol"]
    return np.maximum(RESOLVED * rtol * size[k.group], ROUND_OFF * np.maximum(size[k.group], k.scale))


def _ahead(found: np.ndarray, rows: int) -> np.ndarray:
    """Errors (rows × n, growing) as they are a little later."""
    later = np.arange(len(found)) + int(np.ceil(AHEAD * rows))
    return found[np.minimum(later, len(found) - 1)]


def _shared(found: np.ndarray, k: Kinds, floor: np.ndarray) -> np.ndarray:
    """Errors of which each component of a vector that has one beyond round-off has at least a part of the largest."""
    out = found.copy()
    beyond = found[-1:].max(axis=0, initial=0.0) > floor
    for g in np.flatnonzero(np.bincount(k.group) > 1):
        places = np.flatnonzero((k.group == g) & beyond)
        if not len(places):
            continue
        out[:, places] = np.maximum(found[:, places], SHARED * found[:, places].max(axis=1, keepdims=True))
    return out


def _promise(run: Result, tighter: Result, pairs: Pairs, end: float, states: np.ndarray) -> Promise:
    """Until when the errors hold. end: time up to which both runs went, s; states: errors of coordinates and rates over scale and
    size, rows."""
    ends = [Promise(pairs.alone, "events", pairs.about)]
    rows = np.minimum(np.searchsorted(run.time, [e.time for e in run.events]), len(states) - 1)
    near = [e for e, row in zip(run.events, rows, strict=True) if e.margin < DECIDED * states[row]]
    marked = [e for e in (*run.events, *tighter.events) if e.marginal]
    if doubtful := [e for e in (*near, *marked) if e.kind not in TOLD]:
        e = min(doubtful, key=lambda e: e.time)
        ends.append(Promise(e.time, "marginal", f"{e.kind.replace('_', ' ')} of {e.joint}"))
    big = np.flatnonzero(states > LINEAR)
    if len(big):
        ends.append(Promise(float(run.time[big[0]]), "growth", doubling=_doubling(run.time[: len(states)], states, big[0])))
    if run.outcome.name != tighter.outcome.name:
        stopped = tighter.outcome.name == "stopped"
        about = "" if stopped else f"{tighter.outcome.name} at {tighter.outcome.time:.6g} s"
        ends.append(Promise(end, "stopped" if stopped else "outcome", about))
    least = min(ends, key=lambda p: p.until)
    return least if least.until < inf else Promise()


def _doubling(times: np.ndarray, states: np.ndarray, last: int) -> float:
    """Time in which the errors doubled on their way from a thousandth of ``LINEAR`` to it, s; infinity where they came at once."""
    before = np.flatnonzero(states[:last] < 1e-3 * LINEAR)
    first = int(before[-1]) if len(before) else 0
    if last - first < 5 or states[first] <= 0.0:
        return inf
    return float((times[last] - times[first]) * np.log(2.0) / np.log(states[last] / states[first]))
