"""Cases of a batch that step together in SIMD lanes (``runtime/hosts/lane_batch.c``), called through ctypes."""

from __future__ import annotations

import ctypes
import time

import numpy as np

from trunnion.basics.interrupts import Unwanted
from trunnion.batch.execution.batch_memory import CaseBlocks
from trunnion.batch.execution.cancellation_and_time_limit import CALL_SECONDS, Tick
from trunnion.kernel.shared_libraries import lanes_fit
from trunnion.runtime.abi.batch_records import BATCH, ENSEMBLE, STRAND, STRANDS
from trunnion.runtime.abi.enumerations import Strand
from trunnion.simulation.runtime_interface import simulation_block as bl


class LaneBatch:
    """The cases of a loop that step together in SIMD lanes. Each case has its own memory block and buffers."""

    def __init__(self, loop: CaseBlocks):
        self.loop, self.lib = loop, loop.lib
        self.all, self.strands = ENSEMBLE.ctype(), (STRAND.ctype * STRANDS)()
        self.batches = [BATCH.ctype.from_buffer_copy(loop.batch) for _ in range(STRANDS)]
        self.all.lanes, self.all.strand = loop.model.kernel.lanes(), ctypes.addressof(self.strands)
        self.all.columns = loop.model.kernel.lane_columns()
        self.all.strands = STRANDS
        rows = 8 * loop.batch.capacity * loop.width
        for strand, b in zip(self.strands, self.batches, strict=True):
            strand.batch = ctypes.addressof(b)
            b.variant[0].plain = loop._buffer(loop.blocks[0].bytes)
            b.rows = loop._buffer(rows)
        self.budget = 200

    def run(self, n: int, tick: Tick | None) -> tuple[np.ndarray, bool]:
        """Run the n cases of the loop's batch. Returns (``Ended`` of each case (n), whether the tick returned False).

        Raises all exceptions of the tick, except Unwanted.
        """
        ended = np.zeros(n, np.intc)
        for b in self.batches:
            for name in ("p", "y", "given", "inputs", "set", "out", "settings"):
                setattr(b, name, getattr(self.loop.batch, name))
        self.all.ncases, self.all.ended = n, ended.ctypes.data
        at = ctypes.addressof(self.all)
        self.lib.tr_ensemble_begin(at)
        self.since = {}
        while True:
            began, used = time.perf_counter(), time.thread_time()
            status = self.lib.tr_ensemble_run(at, self.budget)
            spent = time.perf_counter() - began
            self.loop.seconds += time.thread_time() - used
            if status == bl.DONE:
                return ended, False
            if status == bl.NEED_JACOBIAN:
                self._jacobian()
            else:
                self.budget = int(min(max(self.budget * min(2.0, max(0.5, CALL_SECONDS / max(spent, 1e-6))), 20), 1_000_000))
                self._drop_slow_cases()
            try:
                if tick is not None and not tick(int(self.all.finished)):
                    return ended, True
            except Unwanted:
                return ended, True

    since: dict[int, float]
    """{case: processor time at the first check of the case, s}."""

    def _drop_slow_cases(self) -> None:
        """Remove the cases that may have reached their CPU-time limit. These cases run alone later, so that their time is measured
        exactly."""
        if self.loop.watch.cpu_limit == float("inf"):
            return
        now = time.thread_time()
        going = {b.at: i for i, b in enumerate(self.batches) if self.strands[i].state != Strand.OVER}
        self.since = {case: self.since.get(case, now) for case in going}
        for case, since in self.since.items():
            if now - since > self.loop.watch.cpu_limit:
                self.lib.tr_ensemble_drop(ctypes.addressof(self.all), going[case])

    def _jacobian(self) -> None:
        """Attach the compiled Jacobian to all cases, and allocate blocks with room for the Jacobian. Then resume the cases that
        wait for the Jacobian."""
        v = self.loop.batch.variant[0]
        if not v.full:
            self.loop.batch.which = 0
            self.loop._jacobian()
        for b in self.batches:
            own = b.variant[0]
            own.j, own.full_bytes, own.full = v.j, v.full_bytes, own.full or self.loop._buffer(v.full_bytes)
        self.lib.tr_ensemble_resume(ctypes.addressof(self.all))


def lane_batch_of(loop: CaseBlocks) -> LaneBatch | None:
    """The lane batch of a loop. None if rows are stored, if the scene has real-time steps, or if the scene does not support
    lanes."""
    if loop.series is not None or loop.step_events or not lanes_fit(loop.model.kernel):
        return None
    return LaneBatch(loop)
