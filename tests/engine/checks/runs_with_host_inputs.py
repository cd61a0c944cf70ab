"""Runs in which a host declares inputs with derivatives at communication points, as in co-simulation by an FMU."""

from __future__ import annotations

import ctypes

import numpy as np

from tests.reference.scenes.brief_threshold_crossings import BriefPass
from trunnion import Scene
from trunnion.runtime.abi.enumerations import Status
from trunnion.runtime.abi.run_records import INPUT
from trunnion.simulation.results.event_decoder import decode
from trunnion.simulation.results.result_data import Event
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.c_signatures import TYPES
from trunnion.simulation.runtime_interface.simulation_block import Settings

SIGNATURES = {"tr_input_record": "ppi", "tr_reach": "ipddlp", "tr_cut": "ipd", "tr_resume": "ipi"}
STEPS = 1_000_000


class HostRun:
    """One run of a scene whose inputs a host declares. Has the events, and the columns of the last row only."""

    def __init__(self, scene: Scene, case: BriefPass, method: str, rtol: float):
        self.model, self.case = Model(scene, [f"{n}.q*" for n in case.parts], "parts"), case
        for name, codes in SIGNATURES.items():
            function = getattr(self.model.block.lib, name)
            function.restype, function.argtypes = TYPES[codes[0]], [TYPES[a] for a in codes[1:]]
        self.row, settings = np.zeros(self.model.block.width), Settings(rtol, method)
        self.model.block.configure(settings)
        assert self.model.block.assemble() == 1
        assert self.model.begin(settings, 0.0, np.inf, np.inf, self.row) == Status.OK
        points = {t for s in case.inputs.values() for t, _ in s.pieces if 0.0 < t < case.until}
        records = [self._reach(t) for t in sorted(points | {case.until})]
        self.events: list[Event] = decode(self.model.system, np.concatenate(records))
        self.time = self.row[:1]

    def __getitem__(self, column: str) -> np.ndarray:
        at = [c.name for c in self.model.columns].index(column)
        return self.row[at + 1 : at + 2]

    def _reach(self, t: float) -> np.ndarray:
        """Run to t, s, and declare the inputs at t. Returns the event records."""
        block = self.model.block
        while (status := block.lib.tr_reach(block.at, t, t, STEPS, self.row.ctypes.data)) == Status.NEED_JACOBIAN:
            block.attach_jacobian()
        assert status == Status.DONE
        found = block.take_events()
        assert block.lib.tr_cut(block.at, t) == Status.OK
        for name, signal in self.case.inputs.items():
            begin, values = [p for p in signal.pieces if p[0] <= t][-1]
            record = INPUT.ctype.from_address(block.lib.tr_input_record(block.at, self.model.system.inputs.index(name)))
            record.t0, record.u = begin, (ctypes.c_double * 3)(*values)
        assert block.lib.tr_resume(block.at, 0) == Status.OK
        return found
