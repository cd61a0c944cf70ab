"""Records a run step by step: the state and modes of each step, and the mode changes at its end."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np

from trunnion.basics.errors import SimulationError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.abi import EventKind
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
MOST_SOLVED = 4096
"""Largest number of steps whose multipliers are stored. In later steps, the integration of tangents solves for the multipliers
again, which takes longer."""
SAME_TIME = 1e-12
"""A sample counts as at the end of a step if the difference of their times is below this value times max(time, 1 s)."""
GO_ON = (bl.DONE, bl.MORE, bl.EVENTS_FULL, bl.ROWS_FULL, bl.OK)


@dataclass(frozen=True)
class RecordedStep:
    """One step of a run, from t0 to t1.

    Attributes:
        y1: state at its end.
        x: external values during the step, with frozen modes.
        x1: external values after its end.
        changes_mode: whether a flag or mode changes, or an impact occurs, at the end of the step. Changes of signals do not
            count.
        impact: record of the impact at its end (``tr_impact_length``); its first number is 0 without impact.
        sample: whether the step ends at a sample time.
    """

    t0: float
    t1: float
    y1: np.ndarray
    x: np.ndarray
    x1: np.ndarray
    changes_mode: bool
    sample: bool
    impact: np.ndarray


@dataclass(frozen=True)
class StepRecord:
    """A recorded run of n steps.

    Attributes:
        time, y, after: time (s), state and external values before the first step, then at the end of each step (n + 1 rows).
        x: external values during each step, with frozen modes (n rows).
        stages: multipliers of the first steps, at each row of K of the method (at most n rows).
        solved: whether ``stages`` has the step's multipliers (n). False if an event has cut the step.
        changes_mode, sample, impact: as in ``RecordedStep``, of each step (n rows).
        samples: sample times, the start included, s.
        passed: number of samples before the first step, then up to the end of each step (n + 1).
        rows: one output row for each sample time.
    """

    time: np.ndarray
    y: np.ndarray
    after: np.ndarray
    x: np.ndarray
    stages: np.ndarray
    solved: np.ndarray
    changes_mode: np.ndarray
    sample: np.ndarray
    impact: np.ndarray
    samples: np.ndarray
    passed: np.ndarray
    rows: np.ndarray

    def step(self, k: int) -> RecordedStep:
        """The record of step k."""
        return RecordedStep(
            float(self.time[k]), float(self.time[k + 1]), self.y[k + 1], self.x[k], self.after[k + 1],
            bool(self.changes_mode[k]), bool(self.sample[k]), self.impact[k],
        )  # fmt: skip


def record_steps(model: Model, samples: np.ndarray, every: float, rtol: float, tick: Tick) -> StepRecord:
    """Run with rk8 from the assembled start through all sample times, which are multiples of ``every`` and the end (s).
    Raises SimulationError if the run fails, or if its audit finds the run inaccurate."""
    settings, end = bl.Settings(rtol=rtol, method=RK8.name), samples[-1]
    model.block.configure(settings)
    rows = np.zeros((len(samples) + 1, model.block.width))
    status = model.begin(settings, 0.0, end, every, rows[0])
    if status != bl.OK:
        raise SimulationError(f"the run cannot start: {from_status(status, 0.0, '')}")
    block, recorder = model.block, _Recorder(model, rows)
    if model.system.unilateral and (block.take_events()["kind"] == EventKind.CONTACT_CLOSED).any():
        raise SimulationError("the run begins with an impact, across which derivatives are unknown: start before it")
    while status != bl.DONE:
        tick()
        status = recorder.advance(end)
        if status not in GO_ON:
            raise SimulationError(f"the run ends early: {from_status(status, block.time, '')}")
        if recorder.count > MOST_STEPS:
            raise SimulationError(
                "the run is too stiff for derivatives through an explicit method: raise v_eps or shorten the run"
            )
    if recorder.written < len(samples):
        code = block.row(rows[len(samples) - 1])
        if code != bl.OK:
            raise SimulationError(f"the run ends early: {from_status(code, block.time, '')}")
    _check_audit(model, end)
    return recorder.record(samples)


class _Recorder:
    """Advances a run and collects its steps. rows: receives the output rows, of which the first is known. count: number of steps so
    far."""

    def __init__(self, model: Model, rows: np.ndarray):
        self.block, self.flags, self.count, self.rows = model.block, model.system.external.flags, 0, rows
        block, sizes = model.block, model.kernel.sizes
        wide = RK8.rows * (sizes["active"] + sizes["neta"])
        start = (np.array([block.time]), block.y.copy()[None], block.x.copy()[None], block.x.copy()[None])
        self.parts: list[tuple[np.ndarray, ...]] = [start]
        self.solutions: list[tuple[np.ndarray, np.ndarray]] = [(np.zeros((0, wide)), np.zeros(0, np.intc))]
        lengths = (block.y.size, block.x.size, block.x.size)
        impact = block.lib.tr_impact_length(block.at) if model.system.unilateral else 1
        self._impacts = np.zeros((STEPS_PER_CALL, impact))
        self._room: tuple[np.ndarray, ...] = (np.zeros(STEPS_PER_CALL), *(np.zeros((STEPS_PER_CALL, n)) for n in lengths))
        self._solved = np.zeros((STEPS_PER_CALL, wide)), np.zeros(STEPS_PER_CALL, np.intc)
        self._made, self._written = ctypes.c_int(0), ctypes.c_long(1)
        self.impacts = [np.zeros((0, impact))]
        arrays: tuple[np.ndarray, ...] = (*self._room, *self._solved, self._impacts)
        self._places = [a.ctypes.data for a in arrays]

    @property
    def written(self) -> int:
        """Number of rows written so far."""
        return self._written.value

    def advance(self, target: float) -> int:
        """Make at most STEPS_PER_CALL steps towards ``target``, s; returns the status."""
        status = self.block.lib.tr_record_steps(
            self.block.at, target, STEPS_PER_CALL, self.rows.ctypes.data, len(self.rows), ctypes.addressof(self._written),
            *self._places, ctypes.addressof(self._made),
        )  # fmt: skip
        n = self._made.value
        self.parts.append(tuple(a[:n].copy() for a in self._room))
        stages, whole = self._solved
        self.solutions.append((stages[: n if self.count < MOST_SOLVED else 0].copy(), whole[:n].copy()))
        self.impacts.append(self._impacts[:n].copy())
        self.count += n
        return status

    def record(self, samples: np.ndarray) -> StepRecord:
        """The record of the finished run."""
        time, y, begin, after = (np.concatenate(a) for a in zip(*self.parts, strict=True))
        stages, whole = (np.concatenate(a) for a in zip(*self.solutions, strict=True))
        impacts = np.concatenate(self.impacts)
        # Signals may jump at a break. Modes may therefore change at the start of a step that begins at a break.
        breaks, near = np.array(self.block.numbers.break_times(time[-1])), SAME_TIME * np.maximum(1.0, time)
        at_break = np.searchsorted(breaks, (time + near)[:-1], side="right") > np.searchsorted(breaks, (time - near)[:-1])
        first = np.where(at_break[:, None], begin[1:], after[:-1])
        # Frozen directions of pairs with several components change at the start of every step that no event has cut.
        turned = (np.sign(first[:, self.flags]) != np.sign(after[1:, self.flags])).any(axis=1) & (whole == 0)
        turned |= impacts[:, 0] > 0.0
        x = after[1:].copy()
        x[turned] = first[turned]
        passed = np.searchsorted(samples, time + near, side="right")
        passed[-1] = len(samples)
        sample = passed[1:] > np.maximum(np.searchsorted(samples, (time - near)[1:]), passed[:-1])
        solved = whole * (np.arange(self.count) < len(stages))
        return StepRecord(time, y, after, x, stages, solved, turned, sample, impacts, samples, passed, self.rows[: len(samples)])


def _check_audit(model: Model, until: float) -> None:
    """Raise SimulationError if the audit finds the finished run inaccurate. until: end of the run, s."""
    audit = audit_of(model.block.judgement(), [j.name for j in model.system.frictional])
    ended = judged(Outcome(DONE, until), audit)
    if not ended.ok:
        raise SimulationError(f"the run cannot be differentiated, because its result is not reliable: {ended}")
