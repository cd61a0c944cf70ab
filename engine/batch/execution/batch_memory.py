"""The memory of a batch in C: the batch record, blocks of both kernel variants, and buffers for rows."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Sequence

import numpy as np

from trunnion.batch.execution.cancellation_and_time_limit import Watch
from trunnion.batch.preparation.case_parameters import Rows
from trunnion.batch.tables.reductions import Reduction, wanted_columns
from trunnion.batch.tables.trajectories import Series
from trunnion.kernel.shared_libraries import Kernel
from trunnion.runtime.abi.batch_records import BATCH, CASE, REDUCED
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.runtime_interface.c_signatures import library
from trunnion.simulation.settings.realtime_steps import bounds_of
from trunnion.simulation.settings.run_settings import Run

CAPACITY = 256
"""Number of rows in the buffer. When the buffer is full, C updates the reductions from the rows and empties the buffer."""
STORED_BUFFERS = 8
"""Capacity for stored rows, in multiples of CAPACITY. When this memory is full, Python must take the rows."""


class CaseBlocks:
    """The batch record, the memory blocks and the buffers with which C runs cases of one structure. Only one thread at a time may
    use an instance."""

    def __init__(self, rows: Rows, chosen: Sequence[Reduction], run: Run, kernel: str, series: Series | None = None):
        self.lib = library()
        self.chosen, self.series = tuple(chosen), series
        wanted = wanted_columns(chosen) if series is None else (*wanted_columns(chosen), *series.names)
        self.model = Model(rows.built.scene, tuple(dict.fromkeys(wanted)), kernel, built=rows.built)
        self.build_seconds = self.model.build_seconds
        self.batch = BATCH.ctype()
        self.memory: list[object] = []
        self.blocks: list[bl.Block] = []
        self.watch = Watch(run.cpu_limit)
        scene = rows.built.scene
        bounds, through = bounds_of(scene), scene.simulation.jams == "impact"
        self.step_events = 1 + bounds["events"] if bounds else 0
        self._variant(self.model.kernel)
        settings = bl.Settings(method=run.method_of(scene), max_steps=int(run.max_steps or 0), through_jams=through, **bounds)
        self.batch.settings = settings.record(length=1.0, rate=1.0, energy=0.0)
        self.width = self.blocks[0].width
        self.layout = np.dtype([("case", CASE.dtype), ("columns", REDUCED.dtype, (self.width,))])
        self.batch.width, self.batch.capacity = self.width, CAPACITY
        self.batch.ntable = self.blocks[0]._sizes[1]
        self.batch.rows = self._buffer(8 * CAPACITY * self.width)
        self.budget, self.seconds = 500, 0.0
        self.kept: list[np.ndarray] = []
        if series is not None:
            self.batch.kept_capacity = STORED_BUFFERS * CAPACITY
            self.batch.kept = self._buffer(8 * self.batch.kept_capacity * (self.width + 1))
            self.taken = np.ctypeslib.as_array(self.memory[-1])  # type: ignore[call-overload]
            places = {"time": 0} | {c.name: i + 1 for i, c in enumerate(self.model.columns)}
            self.of_series = [0, *(1 + places[n] for n in ("time", *series.names))]

    def _buffer(self, size: int) -> int:
        """Address of ``size`` zeroed bytes that live as long as this object."""
        self.memory.append((ctypes.c_double * (size // 8 + 4))())
        return ctypes.addressof(self.memory[-1])  # type: ignore[arg-type]

    def _variant(self, made: Kernel) -> None:
        """Add the blocks of a kernel. The kernel is the plain kernel of the scene or its variant for redundant loops."""
        s = made.sizes
        events = 64 + 4 * (s["nsliders"] + s["nstops"]) + 2 * self.step_events * (1 + s["nsliders"] + s["nstops"])
        numbers, table = self.model.built.numbers, self.model.built.parameters
        block = bl.Block(made, numbers, np.array(table.values), events)
        v = self.batch.variant[len(self.blocks)]
        v.fresh, v.plain = block.at, self._buffer(block.bytes)
        self.lib.tr_ask(block.at, ctypes.cast(self.watch.host, ctypes.c_void_p))  # each case begins as a copy of this block
        self.blocks.append(block)

    def _redundant(self) -> None:
        made = self.model.variant(True)
        self.build_seconds += made.build_seconds
        self._variant(made)

    def _jacobian(self) -> None:
        """Attach the compiled Jacobian to the present variant of the kernel, and allocate a block with room for the Jacobian."""
        block, v = self.blocks[self.batch.which], self.batch.variant[self.batch.which]
        started = time.perf_counter()
        v.j = block.kernel.jacobian()
        self.build_seconds += time.perf_counter() - started
        k, o = block.kernel.address("kernel"), block.kernel.address("outputs")
        v.full_bytes = self.lib.tr_size(k, o, v.j, *block._sizes)
        v.full = self._buffer(v.full_bytes)
