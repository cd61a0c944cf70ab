"""Records a run step by step: the state and modes of each step, and the mode changes at its end."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from trunnion.basics.problems import SimulationError
from trunnion.runtime.integrators import RK8
from trunnion.simulation.results.audit import audit_of, judged
from trunnion.simulation.results.outcome import DONE, Outcome, from_status
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl

Tick = Callable[[], None]
"""A function that is called at least once in STEPS_PER_CALL steps. Any exception that the function raises ends the analysis."""
MOST_STEPS = 100_000
STEPS_PER_CALL = 64
"""Largest number of steps between two calls of a tick."""
LEAST_STEPS = 100
"""Least number of steps of a run. A minimum is needed because error control does not cover integrals such as friction work. For a
driven mechanism, it would allow a single step."""
GO_ON = (bl.DONE, bl.MORE, bl.EVENTS_FULL, bl.ROWS_FULL, bl.OK)


@dataclass(frozen=True)
class RecordedStep:
    """One step of a run, from (t0, y0) to (t1, y1).

    Attributes:
        x: external values during the step, with frozen modes.
        x1: external values after its end.
        changes_mode: whether a flag or mode changes at the end of the step. Changes of signals do not count.
        sample: whether the step ends at a sample time.
    """

    t0: float
    t1: float
    y0: np.ndarray
    y1: np.ndarray
    x: np.ndarray
    x1: np.ndarray
    changes_mode: bool
    sample: bool


@dataclass(frozen=True)
class StepRecord:
    """A recorded run of n steps.

    Attributes:
        time, y, after: time, s, state and external values before the first step, then at the end of each step (n + 1 rows).
        x: external values during each step, with frozen modes (n rows).
        changes_mode, sample: as in ``RecordedStep``, of each step (n).
        rows: one output row for each sample time, the start included.
    """

    time: np.ndarray
    y: np.ndarray
    after: np.ndarray
    x: np.ndarray
    changes_mode: np.ndarray
    sample: np.ndarray
    rows: np.ndarray

    def step(self, k: int) -> RecordedStep:
        """Step k."""
        return RecordedStep(
            float(self.time[k]), float(self.time[k + 1]), self.y[k], self.y[k + 1], self.x[k], self.after[k + 1],
            bool(self.changes_mode[k]), bool(self.sample[k]),
        )  # fmt: skip


def record_steps(model: Model, samples: Sequence[float], rtol: float, tick: Tick) -> StepRecord:
    """Run with rk8 from the assembled start through all sample times (s). SimulationError if the run fails or its audit finds it
    inaccurate."""
    settings = bl.Settings(rtol=rtol, method=RK8.name, max_step=samples[-1] / LEAST_STEPS)
    model.block.configure(settings)
    row = np.zeros(model.block.width)
    status = model.begin(settings, 0.0, samples[-1], 2 * samples[-1], row)
    if status != bl.OK:
        raise SimulationError(f"the run cannot start: {from_status(status, 0.0, '')}")
    block = model.block
    recorder, rows = _Recorder(model), [row.copy()]
    for target in samples[1:]:
        status = bl.MORE
        while status != bl.DONE:
            tick()
            status = recorder.advance(target)
            if status not in GO_ON:
                raise SimulationError(f"the run ends early: {from_status(status, block.time, '')}")
            if recorder.count > MOST_STEPS:
                raise SimulationError(
                    "the run is too stiff for derivatives through an explicit method: raise v_eps or shorten the run"
                )
        code = block.row(row)
        if code != bl.OK:
            raise SimulationError(f"the run ends early: {from_status(code, block.time, '')}")
        rows.append(row.copy())
    _check_audit(model, samples[-1])
    return recorder.record(np.array(rows))


class _Recorder:
    """Advances a run and collects its steps. count: number of steps so far."""

    def __init__(self, model: Model):
        self.block, self.flags, self.count = model.block, model.system.external.flags, 0
        block = model.block
        self.parts = [(np.array([block.time]), block.y.copy()[None], block.x.copy()[None])]
        self.sampled: list[int] = []
        self._rows = np.zeros((4, block.width))
        self._room = np.zeros(STEPS_PER_CALL), np.zeros((STEPS_PER_CALL, block.y.size)), np.zeros((STEPS_PER_CALL, block.x.size))
        self._made = ctypes.c_int(0)
        self._places = [a.ctypes.data for a in self._room]

    def advance(self, target: float) -> int:
        """Make at most STEPS_PER_CALL steps towards ``target``, s; returns the status."""
        rows = self._rows
        status = self.block.lib.tr_record_steps(
            self.block.at, target, STEPS_PER_CALL, rows.ctypes.data, len(rows), *self._places, ctypes.addressof(self._made)
        )
        n = self._made.value
        t, y, x = self._room
        self.parts.append((t[:n].copy(), y[:n].copy(), x[:n].copy()))
        self.count += n
        if status == bl.DONE:
            self.sampled.append(self.count - 1)
        return status

    def record(self, rows: np.ndarray) -> StepRecord:
        """The record of the finished run."""
        time, y, after = (np.concatenate(a) for a in zip(*self.parts, strict=True))
        x, sample = after[1:].copy(), np.zeros(self.count, np.intc)
        sample[self.sampled] = 1
        before, now = after[:-1, self.flags], after[1:, self.flags]
        turned = (np.sign(before) != np.sign(now)).any(axis=1)
        # Frozen directions of several components may differ in magnitude, because every step renews them.
        x[turned] = after[:-1][turned]
        return StepRecord(time, y, after, x, turned, sample, rows)


def _check_audit(model: Model, until: float) -> None:
    """Raise SimulationError if the audit finds the finished run inaccurate. until: end of the run, s."""
    audit = audit_of(model.block.judgement(), [j.name for j in model.system.frictional])
    ended = judged(Outcome(DONE, until), audit)
    if not ended.ok:
        raise SimulationError(f"the run cannot be differentiated, because its result is not reliable: {ended}")
