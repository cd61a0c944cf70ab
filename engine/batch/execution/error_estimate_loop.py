"""Cases with error estimates of their reductions. A second, tighter run of each case gives the estimates (theory, "Global
error")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from trunnion.batch.execution.c_case_loop import Loop, Reduced
from trunnion.batch.execution.cancellation_and_time_limit import Tick
from trunnion.batch.preparation.case_parameters import Rows
from trunnion.batch.tables.reductions import ERROR, EVENT_NUMBERS, OF_COLUMNS, OF_DECISIONS, Reduction, event_kind
from trunnion.batch.tables.trajectories import Series
from trunnion.kernel.interface.output_columns import columns
from trunnion.runtime.abi import EventKind
from trunnion.runtime.abi.batch_records import CASE_SETTINGS
from trunnion.simulation.global_error import error_estimate as rules
from trunnion.simulation.global_error.column_error_kinds import COORDINATES, kinds
from trunnion.simulation.global_error.event_pairs import REPORTED
from trunnion.simulation.global_error.tighter_run_settings import companion
from trunnion.simulation.results.error_statement import REASONS
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.simulation.settings.run_settings import Run

EXTREMES = ("max", "min", "final")
"""Kinds of reductions by which the two runs of a case are compared."""
BESIDE = 0.3
"""Least stated error of a reduction, relative to the largest error among the reductions of the same column. The limit is needed
because the difference of a single reduction may pass through zero."""
RTOL = CASE_SETTINGS.names.index("rtol")
WHY = tuple(REASONS)
"""Reasons why there is no error estimate, by index. Index 0 means that an error is stated."""


class ErrorEstimateLoop:
    """Runs each case of one structure twice. The class has the interface of ``Loop``. Its reductions are the values from the first
    run, and the errors of these values."""

    def __init__(self, rows: Rows, chosen: Sequence[Reduction], run: Run, kernel: str, series: Series | None = None):
        self.chosen = tuple(chosen)
        everything = columns(rows.built.system)
        about = [_named(r.what) for r in chosen if r.kind == ERROR]
        shown = {c for k, c in [(r.kind, r.what) for r in chosen if r.kind != ERROR] + about if k in OF_COLUMNS}
        state = [c.name for c in everything if c.quantity.name in COORDINATES]
        wanted = [(r.kind, r.what) for r in chosen if r.kind != ERROR] + about
        wanted += [(k, c) for c in [*shown, *state] for k in EXTREMES]
        wanted += [("count", k) for k, n in EVENT_NUMBERS.items() if EventKind(n).name.lower() not in REPORTED]
        wanted += [(k, "") for k in OF_DECISIONS]
        self.wanted = list(dict.fromkeys(wanted))
        self.at = {w: i for i, w in enumerate(self.wanted)}
        inner = [Reduction(k, c, "", "") for k, c in self.wanted]
        self.first, self.second = Loop(rows, inner, run, kernel, series), Loop(rows, inner, run, kernel)
        self.model = self.first.model
        self.state = state
        known = [c for c in everything if c.name in {*shown, *state}]
        k = kinds(known, rows.built.numbers)
        self.scale = {c.name: float(k.scale[i]) for i, c in enumerate(known)}
        self.wraps = {c.name for i, c in enumerate(known) if k.wraps[i]}
        self.has_error = {c.name for i, c in enumerate(known) if k.errs[i]}
        self.rate, self.method = rows.built.numbers.rate, run.method_of(rows.built.scene)

    @property
    def build_seconds(self) -> float:
        """Time of symbolic build and compilation so far, s."""
        return self.first.build_seconds + self.second.build_seconds

    def run(self, rows: Rows, tick: Tick | None = None) -> Reduced:
        """Run the cases. If ``tick`` returns False, only cases with two finished runs are returned."""
        n = len(rows.index)
        a = self.first.run(rows, tick and (lambda done: tick(done // 2)))
        at = np.searchsorted(rows.index, a.index)
        rtol, found = np.unique(rows.settings[:, RTOL], return_inverse=True)
        pairs = [companion(Settings(float(r), self.method), {}) for r in rtol]
        tight, larger = (np.array(x)[found] for x in ([s.rtol for s, _ in pairs], [c for _, c in pairs]))
        settings = rows.settings.copy()
        settings[:, RTOL] = tight
        b = self.second.run(replace(rows, settings=settings).some(at), tick and (lambda done: tick((n + done) // 2)))
        both = np.isin(a.index, b.index)
        order = np.argsort(b.index)[np.searchsorted(np.sort(b.index), a.index[both])]
        alike = np.array([x.name == b.outcomes[j].name for x, j in zip(_some(a.outcomes, both), order, strict=True)], bool)
        begun = a.steps[both] > 0
        numbers, why = self._numbers(
            a.numbers[both], b.numbers[order], rows.settings[at[both], RTOL], larger[at[both]], alike, begun
        )
        kept = a.kept if a.kept is None else a.kept[np.isin(a.kept[:, 0], np.flatnonzero(both))]
        return Reduced(a.index[both], numbers, _some(a.outcomes, both), _some(a.audits, both), a.steps[both],
                       a.seconds + b.seconds, kept, why)  # fmt: skip

    def _numbers(
        self, a: np.ndarray, b: np.ndarray, rtol: np.ndarray, larger: np.ndarray, alike: np.ndarray, begun: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(reductions (cases × reductions), reasons why cases have no error estimate (cases)). a, b (cases × wanted): the values of
        both runs.

        rtol (cases): tolerance of the first run; larger (cases): factor on the difference of the runs that accounts for the second
        run's own error;
        alike (cases): whether both runs have the same outcome; begun (cases): whether the first run made a step.
        """
        with np.errstate(invalid="ignore"):  # without an event or margin, both values are infinite
            off = np.abs(a - b)
        for (_, column), i in self.at.items():
            if column in self.wraps:
                off[:, i] = np.abs(np.mod(off[:, i] + np.pi, 2.0 * np.pi) - np.pi)
        off *= rules.SAFETY * larger[:, None]
        states = np.zeros(len(a))
        for name in self.state:
            places = [self.at[k, name] for k in EXTREMES]
            size = self.scale[name] + np.abs(a[:, places]).max(axis=1)
            states = np.maximum(states, off[:, places].max(axis=1) / size)
        why = self._why(a, b, states, alike, begun)
        out = []
        for r in self.chosen:
            if r.kind != ERROR:
                out.append(a[:, self.at[r.kind, r.what]])
                continue
            found = self._error(_named(r.what), a, off, states, rtol)
            out.append(np.where((why == 0) & np.isfinite(a[:, self.at[_named(r.what)]]), found, np.nan))
        return (np.array(out).T if out else np.zeros((len(a), 0))), why

    def _why(self, a: np.ndarray, b: np.ndarray, states: np.ndarray, alike: np.ndarray, begun: np.ndarray) -> np.ndarray:
        """The reason why a case has no error estimate, as an index of WHY, for each case. The index is 0 if both runs make the same
        clear decisions and their errors are small. If several reasons apply, the last of them in ``found`` is given. This reason
        usually occurs earliest in a run and causes the others.
        """
        counts = [i for (k, what), i in self.at.items() if k == "count" and event_kind(what) not in ("any", *REPORTED)]
        margin, marginal = (self.at[k, ""] for k in OF_DECISIONS)
        near = [(alike & (x[:, margin] < rules.DECIDED * states)) | (x[:, marginal] > 0.0) for x in (a, b)]
        other = alike & (a[:, counts] != b[:, counts]).any(axis=1)
        of_one = other & ~(near[0] & near[1])  # only one of the two runs has the event
        found = {
            "growth": ~(states <= rules.LINEAR),
            "outcome": ~alike,  # with different end times, states and events are not comparable
            "events": other,
            "marginal": (near[0] | (b[:, marginal] > 0.0)) & ~of_one,
            "start": ~begun,
        }
        why = np.zeros(len(a), np.int8)
        for reason, here in found.items():
            why[here] = WHY.index(reason)
        return why

    def _error(self, of: tuple[str, str], a: np.ndarray, off: np.ndarray, states: np.ndarray, rtol: np.ndarray) -> np.ndarray:
        """The error of a reduction for each case."""
        kind, what = of
        own = off[:, self.at[of]]
        if kind == "count":
            return np.zeros(len(a))
        if kind == "first":
            floor = rules.RESOLVED * rtol / self.rate + rules.ROUND_OFF * np.abs(a[:, self.at[of]])
            return np.maximum(rules.TIMED * own + floor, rules.STATE * states / self.rate)
        if what not in self.has_error:
            return np.full(len(a), np.nan)
        places = [self.at[k, what] for k in EXTREMES]
        size = np.abs(a[:, places]).max(axis=1)
        floor = np.maximum(rules.RESOLVED * rtol * size, rules.ROUND_OFF * np.maximum(size, self.scale[what]))
        return np.maximum(np.maximum(own, BESIDE * off[:, places].max(axis=1)), floor)


def _named(text: str) -> tuple[str, str]:
    kind, _, what = text.partition(":")
    return kind, what


def _some(every: list, mask: np.ndarray) -> list:
    return [x for x, kept in zip(every, mask, strict=True) if kept]
