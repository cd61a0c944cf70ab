"""Cost control of a second run. The first run records its evaluations. The second run adapts its tolerance so that its own
evaluations stay within a limit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.simulation.execution.run_loop import OneRun, Progress
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.results.result import Result
from trunnion.simulation.runtime_interface.simulation_block import Settings

FINE = 32
"""Evaluations are recorded about every n / FINE steps, where n is the number of steps so far."""
LEAST = 2
"""Smallest number of steps of a call into C."""
SINGLE = 500
"""During this number of steps at the start of a run, the evaluations are recorded after each step."""
STRETCHES = 24
"""Number of stretches of equal work in a run. The tolerance may change after each stretch."""
DEAD = 0.04
"""Relative deviation of the cost below which the tolerance stays unchanged."""
RESTART = 1.3
"""Largest number of evaluations of a second run, relative to the first run. A run that will take more evaluations is abandoned at
any time."""
MEMORY = 0.9
"""In the cost estimate, the weight of a stretch relative to the weight of the following stretch."""
TIGHTER, LOOSER = 0.5, 8.0
"""Smallest and largest factor by which one change multiplies the tolerance."""


def evaluations(model: Model) -> int:
    """Number of right-hand side evaluations in the current run of a model."""
    return model.block.statistics()["rhs_evaluations"]


class CountedRun(OneRun):
    """A run that records its evaluations over time."""

    def __init__(self, model: Model, until: float, every: float, settings: Settings, progress: Progress | None):
        super().__init__(model, until, every, settings, progress)
        self.work: list[tuple[float, int]] = []
        self.taken = 0

    def _first_steps(self) -> int:
        return 1

    def _next_steps(self, steps: int, seconds: float) -> int:
        self.taken += steps
        self.work.append((self.model.block.time, evaluations(self.model)))
        return 1 if self.taken < SINGLE else min(max(LEAST, self.taken // FINE), super()._next_steps(steps, seconds))

    def times(self) -> np.ndarray:
        """Times at which the run's first steps and some later steps end, s."""
        return np.unique([t for t, _ in self.work])

    def pace(self, run: Result, most: tuple[float, float], order: int, tolerances: tuple[float, float]) -> Pace:
        """The limits of a second run. run: result of the first run. most: target number of evaluations of the second run, and the
        number at which the second run is stopped. order: order of the second run's method. tolerances: the tightest and the loosest
        tolerance of the second run."""
        times, evaluated = zip((0.0, 0), *self.work, (run.time[-1], run.stats.rhs_evaluations), strict=True)
        return Pace(np.array(times), np.array(evaluated, float), run.stats.steps, *most, order, *tolerances)


@dataclass(frozen=True)
class Pace:
    """The limits of a second run.

    Attributes:
        times: times of the first run (n), s.
        evaluated: evaluations of the first run up to these times (n).
        steps: number of steps of the first run.
        most: number of evaluations that the second run should take.
        limit: number of evaluations that stops the second run.
        order: order of the second run's method.
        tightest: tightest tolerance of the second run.
        loosest: loosest tolerance of the second run.
    """

    times: np.ndarray
    evaluated: np.ndarray
    steps: int
    most: float
    limit: float
    order: int
    tightest: float
    loosest: float

    def easier(self, rtol: float) -> float:
        """Cost at the tightest tolerance divided by the cost at tolerance ``rtol``."""
        return float((rtol / self.tightest) ** (1.0 / self.order))


class _Abandoned(Exception):
    """A run will exceed its limit of evaluations."""


class PacedRun(OneRun):
    """A run with the tightest tolerance that its limits of evaluations allow.

    given: arguments of ``OneRun``. trial: share of the first run's evaluations; 0: the run is never abandoned. Up to this share,
    the run is abandoned if it would exceed its limit even at the loosest tolerance. Attributes: used: tolerances of the run, in
    order; spent: evaluations at the last choice of the tolerance; cut: whether the run was stopped at its limit."""

    def __init__(self, *given: Any, pace: Pace, trial: float = 0.0):
        super().__init__(*given)
        self.pace, self.used, self.trial = pace, [self.settings.rtol], trial
        self.done, self.spent, self.seen, self.cut = 0.0, 0, [0.0, 0.0], False

    def result_or_none(self) -> Result | None:
        """The result; None if the run was abandoned."""
        try:
            return self.result()
        except _Abandoned:
            return None

    def correction(self, rtol: float) -> float:
        """Factor on the difference of the two runs that accounts for this run's own error. rtol: tolerance of the first run."""
        return 1.0 / (1.0 - max(self.used) / rtol)

    def _first_steps(self) -> int:
        return LEAST

    def _next_steps(self, steps: int, seconds: float) -> int:
        block, pace = self.model.block, self.pace
        spent = evaluations(self.model)
        if spent > pace.limit:
            self.cut = True
            raise KeyboardInterrupt
        done = float(np.interp(block.time, pace.times, pace.evaluated))
        if (done - self.done) * STRETCHES >= pace.evaluated[-1]:
            self._follow(done, spent)
        return min(max(LEAST, pace.steps // (2 * STRETCHES)), super()._next_steps(steps, seconds))

    def _follow(self, done: float, spent: int) -> None:
        """Choose the tolerance with which the rest of the run meets its limit. done, spent: numbers of evaluations of the first run
        and of this run up to the current time."""
        pace, rtol = self.pace, self.used[-1]
        new = ((spent - self.spent) * pace.easier(rtol), done - self.done)
        self.seen = [MEMORY * x + y for x, y in zip(self.seen, new, strict=True)]
        self.done, self.spent = done, spent
        left, may = pace.evaluated[-1] - done, max(pace.most - spent, 1e-3 * pace.most)
        will = self.seen[0] / self.seen[1] * left
        dear, least = will / may, will / pace.easier(pace.loosest)
        if self.trial and least > may and (spent < self.trial * pace.evaluated[-1] or least > RESTART * pace.evaluated[-1]):
            raise _Abandoned
        by = dear / pace.easier(rtol)
        if abs(by - 1.0) < DEAD or left * STRETCHES < pace.evaluated[-1]:
            return
        wanted = rtol * float(np.clip(by**pace.order, TIGHTER, LOOSER))
        self.used.append(float(np.clip(wanted, pace.tightest, pace.loosest)))
        self.model.block.configure(replace(self.settings, rtol=self.used[-1]))
