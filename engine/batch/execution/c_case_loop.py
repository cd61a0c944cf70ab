"""Calls the C loop over cases through ctypes, and serves the loop's requests."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Sequence
from copy import copy

import numpy as np

from trunnion.basics.interrupts import Unwanted
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.batch.execution.batch_memory import CaseBlocks
from trunnion.batch.execution.cancellation_and_time_limit import CALL_SECONDS, Tick
from trunnion.batch.execution.lane_batch import lane_batch_of
from trunnion.batch.execution.outcomes_and_audits import ends_of
from trunnion.batch.preparation.case_parameters import Rows
from trunnion.batch.tables.reductions import EVENT_NUMBERS, OF_COLUMNS, OF_DECISIONS, Reduction, event_kind
from trunnion.batch.tables.trajectories import Series
from trunnion.runtime.abi.enumerations import Ended
from trunnion.simulation.execution.failure_diagnosis import diagnose
from trunnion.simulation.execution.missing_inertia import missing_inertia
from trunnion.simulation.execution.open_loop_report import open_loop
from trunnion.simulation.results.audit import Audit
from trunnion.simulation.results.outcome import Outcome
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.run_settings import Run


@dataclass(frozen=True)
class Reduced:
    """Results of all cases or, if the caller's ``tick`` returned False, of the finished cases.

    Attributes:
        index: indices of the n cases.
        numbers: reductions (n × reductions).
        outcomes: outcomes (n).
        audits: audits (n).
        steps: number of steps of each case (n).
        seconds: processor time of stepping, s.
        kept: stored rows (index among the cases, time, columns); None if no rows are stored.
        why: reason why each case has no error estimate, as an index of REASONS (n); None if errors are not estimated.
    """

    index: np.ndarray
    numbers: np.ndarray
    outcomes: list[Outcome]
    audits: list[Audit]
    steps: np.ndarray
    seconds: float
    kept: np.ndarray | None = None
    why: np.ndarray | None = None


def join_results(a: Reduced, b: Reduced, seconds: float) -> Reduced:
    """The results of two sets of cases, joined. The sets have no stored rows."""
    both = [np.concatenate([x, y]) for x, y in ((a.index, b.index), (a.numbers, b.numbers), (a.steps, b.steps))]
    return Reduced(both[0], both[1], [*a.outcomes, *b.outcomes], [*a.audits, *b.audits], both[2], seconds)


class Loop(CaseBlocks):
    """Runs cases of one structure in C. A loop serves many chunks. Only one thread at a time may use a loop."""

    def __init__(self, rows: Rows, chosen: Sequence[Reduction], run: Run, kernel: str, series: Series | None = None):
        super().__init__(rows, chosen, run, kernel, series)
        self.together = lane_batch_of(self) if kernel == "lanes" and series is None else None

    def run(self, rows: Rows, tick: Tick | None = None) -> Reduced:
        """Run the cases. If ``tick`` returns False, the result holds only the finished cases."""
        if not self.together:
            return self._alone(rows, tick)
        out = self._begin(rows, tick)
        ended, stopped = self.together.run(len(out), tick)
        whole, spent = np.flatnonzero(ended == Ended.WHOLE), self.seconds
        got = self._reduced(rows.index[whole], out[whole], {}, None)
        again = np.flatnonzero(ended == Ended.EARLY)
        if stopped or not len(again):
            return got
        rest = self._alone(rows.some(again), tick and (lambda done: tick(len(whole) + done)))
        return join_results(got, rest, spent + rest.seconds)

    def _begin(self, rows: Rows, tick: Tick | None) -> np.ndarray:
        """Pass a set of cases to C. Returns the records into which C writes their results."""
        b, n = self.batch, len(rows.index)
        out = np.zeros(n, self.layout)
        self.inputs = rows.inputs if rows.inputs.size else np.zeros(1)
        b.p, b.y, b.given = rows.p.ctypes.data, rows.y.ctypes.data, rows.given.ctypes.data
        b.inputs, b.set, b.out = self.inputs.ctypes.data, rows.settings.ctypes.data, out.ctypes.data
        b.ncases, b.at, b.running, b.reported, b.kept_rows, b.examined = n, 0, 0, 0, 0, 0
        self.kept, self.seconds = [], 0.0
        self.watch.begin(tick, lambda: b.at)
        return out

    def _alone(self, rows: Rows, tick: Tick | None) -> Reduced:
        """Run the cases one by one."""
        out = self._begin(rows, tick)
        failed: dict[int, Outcome] = {}
        try:
            n = self._through(out, tick, failed)
        except Unwanted:
            n = self.batch.at
        kept = None if self.series is None else np.concatenate([np.zeros((0, len(self.of_series))), *self.kept])
        kept = kept if kept is None else kept[kept[:, 0] < n]
        return self._reduced(rows.index[:n], out[:n], failed, kept)

    def _reduced(self, index: np.ndarray, out: np.ndarray, failed: dict[int, Outcome], kept: np.ndarray | None) -> Reduced:
        """The results of cases, read from C's records. failed: {index in ``out``: outcome} of failed cases."""
        outcomes, audits = ends_of(out["case"], failed, [j.name for j in self.model.system.frictional])
        return Reduced(index, self._numbers(out), outcomes, audits, out["case"]["steps"].astype(np.int64), self.seconds, kept)

    def _take_kept(self) -> None:
        """Move the stored rows out of C's buffer."""
        if self.series is not None and self.batch.kept_rows:
            n = int(self.batch.kept_rows)
            rows = self.taken[: n * (self.width + 1)].reshape(n, self.width + 1)[:, self.of_series]
            self.kept.append(self.series.thinned(rows))
            self.batch.kept_rows = 0

    def _through(self, out: np.ndarray, tick: Tick | None, failed: dict[int, Outcome]) -> int:
        """Call the C loop until all cases are finished or ``tick`` returns False. Adds the outcomes of failed cases to ``failed``.
        Returns the number of finished cases."""
        b = self.batch
        while True:
            began, used = time.perf_counter(), time.thread_time()
            status = self.lib.tr_batch_run(ctypes.addressof(b), self.budget)
            spent = time.perf_counter() - began
            self.seconds += time.thread_time() - used
            self._take_kept()
            self.watch.pass_on()
            if status == bl.DONE:
                return len(out)
            if status in (bl.CANCELLED, bl.MORE) and b.running and self.watch.is_over_limit():
                self.lib.tr_batch_end(ctypes.addressof(b), bl.Status.FAIL_TIME)
                status = bl.Status.CASE_FAILED
            if status == bl.CANCELLED:
                return int(b.at)
            if status == bl.Status.CASE_FAILED:
                failed[b.at] = self._outcome(out["case"][b.at])
            elif status == bl.Status.NEED_INERTIA:
                b.examined = b.at + 1
                if lacking := missing_inertia(self._case_model()):
                    self.lib.tr_batch_end(ctypes.addressof(b), bl.Status.FAIL_NOT_FINITE)
                    failed[b.at] = lacking
            elif status == bl.NEED_REDUNDANT:
                self._redundant()
                self.watch.case = -1  # restart the time limit, because build time does not count
            elif status == bl.NEED_JACOBIAN:
                self._jacobian()
                self.watch.case = -1
            else:
                self.budget = int(min(max(self.budget * min(2.0, max(0.5, CALL_SECONDS / max(spent, 1e-6))), 50), 1_000_000))
            if tick is not None and not tick(b.at):
                return int(b.at + b.reported)  # a failed case counts as finished

    def _outcome(self, case: np.void) -> Outcome:
        """The diagnosis of the case that has just failed, from the state in the block of the case."""
        model = self._case_model()
        if int(case["status"]) == bl.Status.FAIL_CLOSURE and case["rows"] == 0.0 and model.block.time == 0.0:
            return open_loop(model, int(case["detail"]))
        return diagnose(model, int(case["status"]))

    def _case_model(self) -> Model:
        """The model, with the memory block of the present case."""
        model = copy(self.model)
        model.block = self.blocks[self.batch.which].copied_to(self.batch.now)
        model.kernel = model.block.kernel
        return model

    def _numbers(self, out: np.ndarray) -> np.ndarray:
        """The reductions (cases × reductions). A missing value is NaN."""
        places = {"time": 0} | {c.name: i + 1 for i, c in enumerate(self.model.columns)}
        columns = [np.zeros((len(out), 0))]
        for r in self.chosen:
            if r.kind in OF_COLUMNS:
                columns.append(out["columns"][r.kind][:, [places[r.what]]])
                continue
            if r.kind in OF_DECISIONS:
                columns.append(out["case"][r.kind][:, None])
                continue
            kinds = out["case"]["count" if r.kind == "count" else "first"]
            if r.what != "any":
                columns.append(kinds[:, [EVENT_NUMBERS[event_kind(r.what)]]])
            elif r.kind == "count":
                columns.append(kinds.sum(axis=1, keepdims=True))
            else:
                columns.append(np.fmin.reduce(kinds, axis=1)[:, None])
        return np.concatenate(columns, axis=1)


def invalid(problems: Sequence[object]) -> Outcome:
    """The outcome of a case whose numbers the scene rejects."""
    return Outcome("invalid", 0.0, "", "; ".join(map(str, problems)))
