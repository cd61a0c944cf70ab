"""The global error of a run from a tighter run of the same scene (theory, "Global error")."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from trunnion.simulation.global_error.column_error_kinds import Kinds, differences, kinds
from trunnion.simulation.global_error.event_pairs import REPORTED, Pairs, pair_events
from trunnion.simulation.results.error_statement import Certainty, Promise
from trunnion.simulation.results.outcome import CANCELLED
from trunnion.simulation.results.result import Result
from trunnion.system.construction.start_values_and_scales import Numbers

SAFETY = 1.5
"""Ratio of stated to estimated errors. The ratio is above 1 because two runs may agree by chance."""
SHARED = 0.15
"""Smallest stated error of a vector's component, relative to the largest error of the vector's components. The error of a single
component may pass through zero."""
AHEAD = 0.01
"""The stated error of a row is taken from a row that is later by this share of the run's rows. At the row itself, the difference of
the two runs may pass through zero."""
RESOLVED = 3e-3
"""Smallest stated error, relative to tolerance × size of the column. Without this limit the error could be stated as zero, because
the first steps of two runs may be equal."""
ROUND_OFF = 1e-13
"""Round-off of a column after a few hundred operations, relative to the larger of the column's scale and size."""
LINEAR = 0.3
"""Largest error of a coordinate or rate, relative to its scale plus size, at which the error estimate is still valid."""
DECIDED = 1.0
"""An event may be decided differently if its margin is below this multiple of the state's relative error."""
TIMED = 2.0
"""Additional safety factor for the time of an event. The two runs are compared only once at an event, but in many rows for a
column."""
STATE = 0.3
"""Smallest error of an event's time, relative to (relative error of the state) / (rate scale of the scene)."""
WIDER = 2.0
"""A row this close to an event may lie before the event in one run and after it in the other. The distance is relative to the
difference of the event's times in the two runs."""
NEAR_END = 1e-9
"""An event in this last share of the run may lack a counterpart, because the other run may end before its own event."""


def certainty(run: Result, tighter: Result, numbers: Numbers, correction: float) -> Certainty:
    """The errors of a run, estimated from a tighter run with the same output times. numbers: scales of the scene. correction:
    factor on the difference of the runs that accounts for the tighter run's own error."""
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
    """The largest error of any coordinate or rate up to each row, relative to its scale plus size (rows)."""
    size = np.maximum.accumulate(np.abs(run.data[: len(found), 1:][:, k.states]), axis=0)
    errors = (found[:, k.states] / (k.scale[k.states] + size)).max(axis=1, initial=0.0)
    return np.maximum.accumulate(np.nan_to_num(errors))


def _paired(run: Result, tighter: Result) -> tuple[float, Pairs]:
    """(time that both runs reached, s; paired events of both runs)."""
    end = min(_end(run), _end(tighter))
    every = pair_events(run.events, tighter.events, inf)
    apart = max((abs(a - b) for a, b in every.times.values()), default=0.0)
    return end, pair_events(run.events, tighter.events, end - 10.0 * apart - NEAR_END * end)


def _event_errors(run: Result, pairs: Pairs, gap: float, states: np.ndarray, rate: float) -> list[float]:
    """Errors of the times of the run's events, s, which do not decrease from event to event. Each error is at least STATE × (the
    state's relative error) / (rate scale of the scene)."""
    rtol = 0.0 if run.settings["step"] else run.settings["rtol"]
    errors, largest = [], ROUND_OFF * run.time[-1] + RESOLVED * rtol / rate
    rows = np.minimum(np.searchsorted(run.time, [e.time for e in run.events]), len(states) - 1)
    for i, row in enumerate(rows):
        if i in pairs.times and run.events[i].kind not in REPORTED:
            largest = max(largest, TIMED * gap * abs(pairs.times[i][0] - pairs.times[i][1]))
        errors.append(max(largest, STATE * states[row] / rate))
    for i in reversed(range(len(errors) - 1)):
        if run.events[i].time == run.events[i + 1].time:
            errors[i] = max(errors[i], errors[i + 1])
    return errors


def _end(run: Result) -> float:
    return run.outcome.time if not run.outcome.ok else float(run.settings["until"])


def _shifts(times: np.ndarray, pairs: Pairs, errors: Sequence[float]) -> np.ndarray:
    """For each row: error of the time of an event near the row, s; 0 if there is no event near the row (rows)."""
    shift = np.zeros(len(times))
    for i, (mine, other) in pairs.times.items():
        wide = max(WIDER * abs(mine - other), errors[i])
        first, last = np.searchsorted(times, [min(mine, other) - wide, max(mine, other) + wide])
        shift[first:last] = np.maximum(shift[first:last], errors[i])
    return shift


def _floor(run: Result, k: Kinds) -> np.ndarray:
    """The smallest error that can be stated for each column (n)."""
    size = np.zeros(k.group.max(initial=-1) + 1)
    np.maximum.at(size, k.group, np.abs(np.nan_to_num(run.data[:, 1:])).max(axis=0, initial=0.0))
    rtol = 0.0 if run.settings["step"] else run.settings["rtol"]
    return np.maximum(RESOLVED * rtol * size[k.group], ROUND_OFF * np.maximum(size[k.group], k.scale))


def _ahead(found: np.ndarray, rows: int) -> np.ndarray:
    """Errors (rows × n). Each row of the result contains the errors of the row that is AHEAD · ``rows`` rows later."""
    later = np.arange(len(found)) + int(np.ceil(AHEAD * rows))
    return found[np.minimum(later, len(found) - 1)]


def _shared(found: np.ndarray, k: Kinds, floor: np.ndarray) -> np.ndarray:
    """Errors in which each vector component has at least SHARED times the largest error of the vector's components. Columns whose
    error never exceeds ``floor`` stay unchanged."""
    out = found.copy()
    beyond = found[-1:].max(axis=0, initial=0.0) > floor
    for g in np.flatnonzero(np.bincount(k.group) > 1):
        places = np.flatnonzero((k.group == g) & beyond)
        if not len(places):
            continue
        out[:, places] = np.maximum(found[:, places], SHARED * found[:, places].max(axis=1, keepdims=True))
    return out


def _promise(run: Result, tighter: Result, pairs: Pairs, end: float, states: np.ndarray) -> Promise:
    """The time up to which the errors are valid. end: time that both runs reached, s. states: relative error of the state up to
    each row (rows)."""
    ends = [Promise(pairs.alone, "events", pairs.about)]
    rows = np.minimum(np.searchsorted(run.time, [e.time for e in run.events]), len(states) - 1)
    near = [e for e, row in zip(run.events, rows, strict=True) if e.margin < DECIDED * states[row]]
    marked = [e for e in (*run.events, *tighter.events) if e.marginal]
    if doubtful := [e for e in (*near, *marked) if e.kind not in REPORTED]:
        e = min(doubtful, key=lambda e: e.time)
        ends.append(Promise(e.time, "marginal", f"{e.kind.replace('_', ' ')} of {e.joint}"))
    big = np.flatnonzero(states > LINEAR)
    if len(big):
        ends.append(Promise(float(run.time[big[0]]), "growth", doubling=_doubling(run.time[: len(states)], states, big[0])))
    if run.outcome.name != tighter.outcome.name:
        cancelled = tighter.outcome.name == CANCELLED
        about = "" if cancelled else f"{tighter.outcome.name} at {tighter.outcome.time:.6g} s"
        ends.append(Promise(end, CANCELLED if cancelled else "outcome", about))
    least = min(ends, key=lambda p: p.until)
    return least if least.until < inf else Promise()


def _doubling(times: np.ndarray, states: np.ndarray, last: int) -> float:
    """Time, s, in which the errors double during their growth from LINEAR/1000 to LINEAR. The time is infinite for a sudden rise.
    last: row at which the errors exceed LINEAR."""
    before = np.flatnonzero(states[:last] < 1e-3 * LINEAR)
    first = int(before[-1]) if len(before) else 0
    if last - first < 5 or states[first] <= 0.0:
        return inf
    return float((times[last] - times[first]) * np.log(2.0) / np.log(states[last] / states[first]))
