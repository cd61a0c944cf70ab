"""The C loop over cases, driven through ctypes: blocks, buffers, and what the loop asks for on its way."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from engine.abi.batches import BATCH, CASE, REDUCED
from engine.abi.choices import Ended
from engine.basics.interrupts import Unwanted
from engine.batch.ensemble import ensemble_of
from engine.batch.judging import ends_of
from engine.batch.preparing import Rows
from engine.batch.reductions import EVENT_NUMBERS, OF_COLUMNS, OF_DECISIONS, Reduction, wanted_columns
from engine.batch.series import Series
from engine.batch.watch import CALL_SECONDS, Tick, Watch
from engine.kernel.library import Kernel
from engine.simulation import block as bl
from engine.simulation.audit import Audit
from engine.simulation.bounded import bounds_of
from engine.simulation.diagnosis import diagnose
from engine.simulation.gaps import open_loop
from engine.simulation.library import library
from engine.simulation.outcome import Outcome
from engine.simulation.run import Model
from engine.simulation.settings import Run

CAPACITY = 256
"""How many output rows the buffer holds before they are reduced."""
KEPT_BUFFERS = 8
"""Of rows that are kept: how many buffers they wait in until they are taken out."""


@lru_cache(maxsize=1)
def _library() -> ctypes.CDLL:
    lib = library()
    lib.tr_batch_run.argtypes, lib.tr_batch_run.restype = [ctypes.c_void_p, ctypes.c_long], ctypes.c_int
    lib.tr_batch_end.argtypes, lib.tr_batch_end.restype = [ctypes.c_void_p, ctypes.c_int], None
    lib.tr_batch_size.argtypes, lib.tr_batch_size.restype = [], ctypes.c_size_t
    if lib.tr_batch_size() != ctypes.sizeof(BATCH.ctype):
        raise RuntimeError("batch loop and runtime do not fit each other (cache of another version?)")
    return lib


@dataclass(frozen=True)
class Reduced:
    """The outcome of some cases: of all that were to be run, or of the first of them when the caller's tick said no. index (n):
    which cases; numbers (n × reductions); outcomes, audits and steps (n); seconds: time spent stepping; kept: rows asked for (place
    in index, time, columns); why (n): where errors are asked for, the reason why none is stated, as its place among REASONS."""

    index: np.ndarray
    numbers: np.ndarray
    outcomes: list[Outcome]
    audits: list[Audit]
    steps: np.ndarray
    seconds: float
    kept: np.ndarray | None = None
    why: np.ndarray | None = None


def joined(a: Reduced, b: Reduced, seconds: float) -> Reduced:
    """The outcomes of two sets of cases, of which no rows are kept."""
    both = [np.concatenate([x, y]) for x, y in ((a.index, b.index), (a.numbers, b.numbers), (a.steps, b.steps))]
    return Reduced(both[0], both[1], [*a.outcomes, *b.outcomes], [*a.audits, *b.audits], both[2], seconds)


class Loop:
    """Runs cases of one structure in C. Make it once and use it for many chunks, from one thread at a time."""

    def __init__(self, rows: Rows, chosen: Sequence[Reduction], run: Run, kernel: str, series: Series | None = None):
        self.lib = _library()
        self.chosen, self.series = tuple(chosen), series
        wanted = wanted_columns(chosen) if series is None else (*wanted_columns(chosen), *series.names)
        self.model = Model(rows.built.scene, tuple(dict.fromkeys(wanted)), kernel)
        self.build_seconds = self.model.build_seconds
        self.batch = BATCH.ctype()
        self.memory: list[object] = []
        self.blocks: list[bl.Block] = []
        self.watch = Watch(run.patience)
        scene = rows.built.scene
        bounds, through = bounds_of(scene), scene.simulation.jams == "impact"
        self.step_events = 1 + bounds["events"] if bounds else 0
        self._variant(self.model.kernel)
        settings = bl.Settings(method=run.method_of(scene), max_steps=int(run.steps or 0), through_jams=through, **bounds)
        self.batch.settings = settings.record(length=1.0, rate=1.0, energy=0.0)
        self.width = self.blocks[0].width
        self.layout = np.dtype([("case", CASE.dtype), ("columns", REDUCED.dtype, (self.width,))])
        self.batch.width, self.batch.capacity = self.width, CAPACITY
        self.batch.ntable = self.blocks[0]._sizes[1]
        sizes = self.model.kernel.sizes
        loop_rows = sum(n for _, n in self.model.kernel.facts["loop_rows"])
        self.batch.rows = self._buffer(8 * CAPACITY * self.width)
        self.batch.scratch = self._buffer(8 * (sizes["rows"] + 1) * max(loop_rows, 1))
        self.budget, self.seconds = 500, 0.0
        self.loop_rows = max(loop_rows, 1)
        self.together = ensemble_of(self) if kernel == "lanes" and series is None else None
        self.kept: list[np.ndarray] = []
        if series is not None:
            self.batch.kept_capacity = KEPT_BUFFERS * CAPACITY
            self.batch.kept = self._buffer(8 * self.batch.kept_capacity * (self.width + 1))
            self.taken = np.ctypeslib.as_array(self.memory[-1])  # type: ignore[call-overload]
            places = {"time": 0} | {c.name: i + 1 for i, c in enumerate(self.model.columns)}
            self.of_series = [0, *(1 + places[n] for n in ("time", *series.names))]

    def _buffer(self, size: int) -> int:
        """Address of zeroed memory (``size`` bytes) that lives as long as the loop."""
        self.memory.append((ctypes.c_double * (size // 8 + 4))())
        return ctypes.addressof(self.memory[-1])  # type: ignore[arg-type]

    def _variant(self, made: Kernel) -> None:
        """Add the blocks of a kernel, the plain one or its redundant variant."""
        s = made.sizes
        events = 64 + 4 * (s["nsliders"] + s["nstops"]) + 2 * self.step_events * (1 + s["nsliders"] + s["nstops"])
        numbers, table = self.model.built.numbers, self.model.built.parameters
        block = bl.Block(made, numbers, np.array(table.values), events)
        v = self.batch.variant[len(self.blocks)]
        v.fresh, v.plain = block.at, self._buffer(block.bytes)
        self.lib.tr_ask(block.at, ctypes.cast(self.watch.host, ctypes.c_void_p))  # and with it every case, which begins as its copy
        self.blocks.append(block)

    def _redundant(self) -> None:
        made = self.model.variant(True)
        self.build_seconds += made.build_seconds
        self._variant(made)

    def _jacobian(self) -> None:
        """Give the variant that is running its Jacobian unit, and a block with room for it."""
        block, v = self.blocks[self.batch.which], self.batch.variant[self.batch.which]
        started = time.perf_counter()
        v.j = block.kernel.jacobian()
        self.build_seconds += time.perf_counter() - started
        k, o = block.kernel.address("kernel"), block.kernel.address("outputs")
        v.full_bytes = self.lib.tr_size(k, o, v.j, *block._sizes)
        v.full = self._buffer(v.full_bytes)

    def run(self, rows: Rows, tick: Tick | None = None) -> Reduced:
        """Run the cases; when ``tick`` says no, only those that are finished by then count."""
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
        return joined(got, rest, spent + rest.seconds)

    def _begin(self, rows: Rows, tick: Tick | None) -> np.ndarray:
        """Put cases at hand; returns where what becomes of them is written."""
        b, n = self.batch, len(rows.index)
        out = np.zeros(n, self.layout)
        self.inputs = rows.inputs if rows.inputs.size else np.zeros(1)
        b.p, b.y, b.given = rows.p.ctypes.data, rows.y.ctypes.data, rows.given.ctypes.data
        b.inputs, b.set, b.out = self.inputs.ctypes.data, rows.settings.ctypes.data, out.ctypes.data
        b.ncases, b.at, b.running, b.reported, b.kept_rows = n, 0, 0, 0, 0
        self.kept, self.seconds = [], 0.0
        self.watch.begin(tick, lambda: b.at)
        return out

    def _alone(self, rows: Rows, tick: Tick | None) -> Reduced:
        """Run the cases one after the other."""
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
        """The outcome of cases from what the C loop wrote of them; failed: those that have one of their own, by place."""
        outcomes, audits = ends_of(out["case"], failed, [j.name for j in self.model.system.frictional])
        return Reduced(index, self._numbers(out), outcomes, audits, out["case"]["steps"].astype(np.int64), self.seconds, kept)

    def _take_kept(self) -> None:
        """Take out the rows that are kept."""
        if self.series is not None and self.batch.kept_rows:
            n = int(self.batch.kept_rows)
            rows = self.taken[: n * (self.width + 1)].reshape(n, self.width + 1)[:, self.of_series]
            self.kept.append(self.series.thinned(rows))
            self.batch.kept_rows = 0

    def _through(self, out: np.ndarray, tick: Tick | None, failed: dict[int, Outcome]) -> int:
        """Go through the cases, noting those that fail; how many are finished, not all when ``tick`` says no."""
        b = self.batch
        while True:
            began = time.perf_counter()
            status = self.lib.tr_batch_run(ctypes.addressof(b), self.budget)
            spent = time.perf_counter() - began
            self.seconds += spent
            self._take_kept()
            self.watch.pass_on()
            if status == bl.DONE:
                return len(out)
            if status in (bl.STOPPED, bl.MORE) and b.running and self.watch.impatient():
                self.lib.tr_batch_end(ctypes.addressof(b), bl.Status.FAIL_TIME)
                status = bl.Status.CASE_FAILED
            if status == bl.STOPPED:
                return int(b.at)
            if status == bl.Status.CASE_FAILED:
                failed[b.at] = self._outcome(out["case"][b.at])
            elif status == bl.NEED_REDUNDANT:
                self._redundant()
                self.watch.case = -1  # what is built is not the case's time
            elif status == bl.NEED_JACOBIAN:
                self._jacobian()
                self.watch.case = -1
            else:
                self.budget = int(min(max(self.budget * min(2.0, max(0.5, CALL_SECONDS / max(spent, 1e-6))), 50), 1_000_000))
            if tick is not None and not tick(b.at):
                return int(b.at + b.reported)  # a case that has failed is finished, too

    def _outcome(self, case: np.void) -> Outcome:
        """The diagnosis of the case that just failed, while its block still holds its state, as if the model itself had run the
        case."""
        block = copy(self.blocks[self.batch.which])
        block.at = self.batch.now
        block._views()
        model = copy(self.model)
        model.block, model.kernel = block, block.kernel
        if int(case["status"]) == bl.Status.FAIL_CLOSURE and case["rows"] == 0.0 and block.time == 0.0:
            return open_loop(model, int(case["detail"]))
        return diagnose(model, int(case["status"]))

    def _numbers(self, out: np.ndarray) -> np.ndarray:
        """The reductions asked for (cases × reductions); NaN where there is nothing to reduce."""
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
                columns.append(kinds[:, [EVENT_NUMBERS[r.what]]])
            elif r.kind == "count":
                columns.append(kinds.sum(axis=1, keepdims=True))
            else:
                columns.append(np.fmin.reduce(kinds, axis=1)[:, None])
        return np.concatenate(columns, axis=1)


def invalid(where: Sequence[object]) -> Outcome:
    """The outcome of a case whose numbers the scene refuses."""
    return Outcome("invalid", 0.0, "", "; ".join(map(str, where)))
