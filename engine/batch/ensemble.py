"""Cases of a batch that make their steps together (``runtime/ensemble.c``), driven through ctypes."""

from __future__ import annotations

import ctypes
import time
from typing import TYPE_CHECKING

import numpy as np

from engine.abi.batches import BATCH, ENSEMBLE, STRAND, STRANDS
from engine.abi.choices import Strand
from engine.basics.interrupts import Unwanted
from engine.batch.watch import CALL_SECONDS, Tick
from engine.kernel.lanes_unit import stands_for
from engine.simulation import block as bl

if TYPE_CHECKING:
    from engine.batch.loop import Loop

STACK = 256 * 1024
"""Bytes of a case's stack: a hundred times what a step of the largest compiled scene without friction takes."""
CACHE_LINE = 64


class Ensemble:
    """The cases of a loop that are on their way at one time: blocks, buffers and stacks of their own."""

    def __init__(self, loop: Loop):
        self.loop, self.lib = loop, loop.lib
        self.lib.tr_ensemble_begin.argtypes, self.lib.tr_ensemble_begin.restype = [ctypes.c_void_p], None
        self.lib.tr_ensemble_run.argtypes, self.lib.tr_ensemble_run.restype = [ctypes.c_void_p, ctypes.c_long], ctypes.c_int
        self.lib.tr_ensemble_drop.argtypes, self.lib.tr_ensemble_drop.restype = [ctypes.c_void_p, ctypes.c_int], None
        self.lib.tr_ensemble_resume.argtypes, self.lib.tr_ensemble_resume.restype = [ctypes.c_void_p], None
        self.all, self.strands = ENSEMBLE.ctype(), (STRAND.ctype * STRANDS)()
        self.batches = [BATCH.ctype.from_buffer_copy(loop.batch) for _ in range(STRANDS)]
        self.all.lanes, self.all.strand = loop.model.kernel.lanes(), ctypes.addressof(self.strands)
        self.all.columns = loop.model.kernel.lane_columns()
        self.all.strands, self.all.stack_bytes = STRANDS, STACK
        stacks = loop._buffer(STRANDS * STACK + CACHE_LINE)
        stacks += -stacks % CACHE_LINE
        rows, scratch = 8 * loop.batch.capacity * loop.width, 8 * (loop.model.kernel.sizes["rows"] + 1)
        for i, (strand, b) in enumerate(zip(self.strands, self.batches, strict=True)):
            strand.batch, strand.stack = ctypes.addressof(b), stacks + i * STACK
            b.variant[0].plain = loop._buffer(loop.blocks[0].bytes)
            b.rows, b.scratch = loop._buffer(rows), loop._buffer(scratch * loop.loop_rows)
        self.budget = 200

    def run(self, n: int, tick: Tick | None) -> tuple[np.ndarray, bool]:
        """Run the n cases that the loop's batch has at hand. Returns what became of each (``Ended``), and whether the tick said
        no. Raises what the tick raises."""
        ended = np.zeros(n, np.intc)
        for b in self.batches:
            for name in ("p", "y", "given", "inputs", "set", "out", "settings"):
                setattr(b, name, getattr(self.loop.batch, name))
        self.all.ncases, self.all.ended = n, ended.ctypes.data
        at = ctypes.addressof(self.all)
        self.lib.tr_ensemble_begin(at)
        self.since = {}
        while True:
            began = time.perf_counter()
            status = self.lib.tr_ensemble_run(at, self.budget)
            spent = time.perf_counter() - began
            self.loop.seconds += spent
            if status == bl.DONE:
                return ended, False
            if status == bl.NEED_JACOBIAN:
                self._jacobian()
            elif status == bl.MORE:
                self.budget = int(min(max(self.budget * min(2.0, max(0.5, CALL_SECONDS / max(spent, 1e-6))), 20), 1_000_000))
                self._impatient()
            else:
                raise RuntimeError("a case took more stack than it has; this is a defect of Trunnion, please report its scene")
            if tick is not None and not self._told(tick):
                return ended, True

    def _told(self, tick: Tick) -> bool:
        """What the tick says to the number of cases that have ended."""
        try:
            return tick(int(self.all.finished))
        except Unwanted:
            return False

    since: dict[int, float]
    """When cases that are on their way were first seen, processor seconds."""

    def _impatient(self) -> None:
        """Let go of cases that may have used up their patience (they have been on their way for so long, among others): by
        themselves it is told exactly."""
        if self.loop.watch.patience == float("inf"):
            return
        now = time.thread_time()
        going = {b.at: i for i, b in enumerate(self.batches) if self.strands[i].state != Strand.OVER}
        self.since = {case: self.since.get(case, now) for case in going}
        for case, since in self.since.items():
            if now - since > self.loop.watch.patience:
                self.lib.tr_ensemble_drop(ctypes.addressof(self.all), going[case])

    def _jacobian(self) -> None:
        """Give all cases the Jacobian unit, and blocks with room for it; go on with those that wait for it."""
        v = self.loop.batch.variant[0]
        if not v.full:
            self.loop.batch.which = 0
            self.loop._jacobian()
        for b in self.batches:
            own = b.variant[0]
            own.j, own.full_bytes, own.full = v.j, v.full_bytes, own.full or self.loop._buffer(v.full_bytes)
        self.lib.tr_ensemble_resume(ctypes.addressof(self.all))


def ensemble_of(loop: Loop) -> Ensemble | None:
    """The ensemble of a loop; None where its scene, bounded steps, the columns it keeps, or the processor has none."""
    if loop.series is not None or loop.step_events or not stands_for(loop.model.kernel) or not loop.lib.tr_ensemble_there():
        return None
    return Ensemble(loop)
