"""Records a run step by step: the state and modes of each step, and the mode changes at its end."""

from __future__ import annotations

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
"""Called at least once a step. Any exception raised in the function ends the analysis."""
MOST_STEPS = 100_000
LEAST_STEPS = 100
"""Least number of steps of a run. Error control does not cover integrals such as friction work, and for driven mechanisms it would
allow a single step."""


@dataclass(frozen=True)
class RecordedStep:
    """One step of a run, from (t0, y0) to (t1, y1).

    Attributes:
        x: external values during the step, with frozen modes.
        x1: external values after its end.
        flags: slice of x and x1 that holds the stop flags and modes.
        sample: whether the step ends at a sample time.
    """

    t0: float
    t1: float
    y0: np.ndarray
    y1: np.ndarray
    x: np.ndarray
    x1: np.ndarray
    flags: slice
    sample: bool

    @property
    def changes_mode(self) -> bool:
        """Whether a flag or mode changes at the end of the step. Changes of signals do not count."""
        return not np.array_equal(self.x[self.flags], self.x1[self.flags])


@dataclass(frozen=True)
class StepRecord:
    """A recorded run: its steps, one output row for each sample time (the start included), start state y0 and start external
    values x0."""

    steps: tuple[RecordedStep, ...]
    rows: np.ndarray
    y0: np.ndarray
    x0: np.ndarray


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
    rows, steps = [row.copy()], []
    y, x = block.y.copy(), block.x.copy()
    first = (y.copy(), x.copy())
    buffer = np.zeros((4, block.width))
    flags = model.system.external.flags
    for target in samples[1:]:
        while True:
            tick()
            t = block.time
            status, _ = block.advance(target, 1, buffer)
            block.take_events()
            if status not in (bl.DONE, bl.MORE, bl.EVENTS_FULL, bl.ROWS_FULL, bl.OK):
                raise SimulationError(f"the run ends early: {from_status(status, block.time, '')}")
            if block.time > t:
                after, now = block.x.copy(), block.y.copy()
                used = after if _have_same_signs(x[flags], after[flags]) else x
                steps.append(RecordedStep(t, block.time, y, now, used.copy(), after, flags, status == bl.DONE))
                y, x = now, after
            if status == bl.DONE:
                break
            if len(steps) > MOST_STEPS:
                raise SimulationError(
                    "the run is too stiff for derivatives through an explicit method: raise v_eps or shorten the run"
                )
        code = block.row(row)
        if code != bl.OK:
            raise SimulationError(f"the run ends early: {from_status(code, block.time, '')}")
        rows.append(row.copy())
    _check_audit(model, samples[-1])
    return StepRecord(tuple(steps), np.array(rows), *first)


def _check_audit(model: Model, until: float) -> None:
    """Raise SimulationError if the audit finds the finished run inaccurate. until: end of the run, s."""
    audit = audit_of(model.block.judgement(), [j.name for j in model.system.frictional])
    ended = judged(Outcome(DONE, until), audit)
    if not ended.ok:
        raise SimulationError(f"the run cannot be differentiated, because its result is not reliable: {ended}")


def _have_same_signs(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether flags and modes agree in sign. Frozen directions of several components may differ in magnitude, because every step
    renews them."""
    return bool(np.array_equal(np.sign(a), np.sign(b)))
