"""A run recorded step by step: where each step began, in which modes, and what changed at its end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from engine.basics.problems import SimulationError
from engine.integrators import RK8
from engine.simulation import block as bl
from engine.simulation.audit import audit_of, judged
from engine.simulation.outcome import DONE, Outcome, from_status
from engine.simulation.run import Model

Tick = Callable[[], None]
"""Called at least once a step; what it raises ends the work."""
MOST_STEPS = 100_000
LEAST_STEPS = 100
"""Steps a run has at least: integrals (work of friction) are not part of the error control, and driven mechanisms need no steps."""


@dataclass(frozen=True)
class Leg:
    """One step of a recorded run, from (t0, y0) to (t1, y1). x: the external values in force during it, with frozen modes; x1:
    those after its end; flags: where in them the stop flags and modes are; sample: whether a sample time is at its end."""

    t0: float
    t1: float
    y0: np.ndarray
    y1: np.ndarray
    x: np.ndarray
    x1: np.ndarray
    flags: slice
    sample: bool

    @property
    def changed(self) -> bool:
        """Whether a flag or mode changed at the end of the step. Signals, which change all the time, do not count."""
        return not np.array_equal(self.x[self.flags], self.x1[self.flags])


@dataclass(frozen=True)
class Record:
    """A recorded run: its legs in order, the output rows at the sample times (the first is the start), and state and external
    values at the start."""

    legs: tuple[Leg, ...]
    rows: np.ndarray
    y0: np.ndarray
    x0: np.ndarray


def record(model: Model, samples: Sequence[float], rtol: float, tick: Tick) -> Record:
    """Run from the assembled start through all sample times with the explicit method of order 8. SimulationError when it fails or
    is inaccurate."""
    settings = bl.Settings(rtol=rtol, method=RK8.name, max_step=samples[-1] / LEAST_STEPS)
    model.block.configure(settings)
    row = np.zeros(model.block.width)
    status = model.begin(settings, 0.0, samples[-1], 2 * samples[-1], row)
    if status != bl.OK:
        raise SimulationError(f"the run cannot start: {from_status(status, 0.0, '')}")
    block = model.block
    rows, legs = [row.copy()], []
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
                used = after if _same_flags(x[flags], after[flags]) else x
                legs.append(Leg(t, block.time, y, now, used.copy(), after, flags, status == bl.DONE))
                y, x = now, after
            if status == bl.DONE:
                break
            if len(legs) > MOST_STEPS:
                raise SimulationError("too stiff for derivatives through an explicit method: raise v_eps or shorten the run")
        code = block.row(row)
        if code != bl.OK:
            raise SimulationError(f"the run ends early: {from_status(code, block.time, '')}")
        rows.append(row.copy())
    _judge(model, samples[-1])
    return Record(tuple(legs), np.array(rows), *first)


def _judge(model: Model, until: float) -> None:
    """SimulationError when the audit finds the run that has come to its end, ``until`` s, inaccurate."""
    audit = audit_of(model.block.judgement(), [j.name for j in model.system.frictional])
    ended = judged(Outcome(DONE, until), audit)
    if not ended.ok:
        raise SimulationError(f"a run to be differentiated has to be right: {ended}")


def _same_flags(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether flags and modes agree in sign: the frozen directions of several components, which are renewed in every step, may
    differ."""
    return bool(np.array_equal(np.sign(a), np.sign(b)))
