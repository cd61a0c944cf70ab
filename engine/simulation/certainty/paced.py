"""Two runs of which the second may cost so much of the first: that is counted on its way, and the other's tolerance follows it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from engine.simulation.block import Settings
from engine.simulation.model import Model
from engine.simulation.result import Result
from engine.simulation.stepping import OneRun, Progress

FINE = 32
"""Parts of a run, as far as it has come, in which its evaluations are counted."""
LEAST = 2
"""Steps of a call into C at least."""
SINGLE = 500
"""Steps of a run that are counted one by one."""
STRETCHES = 24
"""Parts of a run's work after which its tolerance may change."""
DEAD = 0.04
"""By so little of it the cost may be off without a change: what is not smooth comes and goes."""
KEPT = 0.9
"""Part of what was seen before that counts as much as a new stretch."""
TIGHTER, LOOSER = 0.5, 8.0
"""Factors of one change of the tolerance at most: what was spent too early is dear to save."""


class Counted(OneRun):
    """A run that notes how much it has evaluated by which time."""

    def __init__(self, model: Model, until: float, every: float, settings: Settings, progress: Progress | None):
        super().__init__(model, until, every, settings, progress)
        self.work: list[tuple[float, int]] = []
        self.taken = 0

    def _first_steps(self) -> int:
        return 1

    def _next_steps(self, steps: int, seconds: float) -> int:
        self.taken += steps
        self.work.append((self.model.block.time, self.model.block.evaluations))
        return 1 if self.taken < SINGLE else min(max(LEAST, self.taken // FINE), super()._next_steps(steps, seconds))

    def times(self) -> np.ndarray:
        """Ends of its steps, s: of all of the first, and of some of those behind."""
        return np.unique([t for t, _ in self.work])

    def pace(self, run: Result, most: float, order: int, tolerances: tuple[float, float]) -> Pace:
        """That of a second run which may take ``most`` evaluations, by a method of this order, within these tolerances (the
        tightest and the loosest). run: what came of this one."""
        times, evaluated = zip((0.0, 0), *self.work, (run.time[-1], run.stats.rhs_evaluations), strict=True)
        return Pace(np.array(times), np.array(evaluated, float), run.stats.steps, most, order, *tolerances)


@dataclass(frozen=True)
class Pace:
    """What a run keeps to. times, evaluated: how often the first run had evaluated by when; steps: how many it made; most: evaluations
    that the second may take; order: of its method; tightest, loosest: its tolerances."""

    times: np.ndarray
    evaluated: np.ndarray
    steps: int
    most: float
    order: int
    tightest: float
    loosest: float

    def easier(self, rtol: float) -> float:
        """How much less a stretch costs at this tolerance than at the tightest."""
        return float((rtol / self.tightest) ** (1.0 / self.order))


class _GivenUp(Exception):
    """A run whose cost comes to more than it may."""


class Paced(OneRun):
    """A run whose tolerance is as tight as its pace allows. used: its tolerances, one after the other; given_up: part of the first
    run's evaluations up to which it ends where it will cost more than it may; spent: evaluations up to then."""

    def __init__(
        self, model: Model, until: float, every: float, settings: Settings, progress: Progress | None, pace: Pace, given_up: float = 0.0
    ):
        super().__init__(model, until, every, settings, progress)
        self.kept_to, self.used, self.given_up = pace, [settings.rtol], given_up
        self.done, self.spent, self.seen = 0.0, 0, [0.0, 0.0]

    def carried_out(self) -> Result | None:
        """Its result; None where it was given up."""
        try:
            return self.result()
        except _GivenUp:
            return None

    def correction(self, rtol: float) -> float:
        """By how much its difference from a run with this tolerance is to be enlarged for its own error."""
        return 1.0 / (1.0 - max(self.used) / rtol)

    def _first_steps(self) -> int:
        return LEAST

    def _next_steps(self, steps: int, seconds: float) -> int:
        block, pace = self.model.block, self.kept_to
        done = float(np.interp(block.time, pace.times, pace.evaluated))
        if (done - self.done) * STRETCHES >= pace.evaluated[-1]:
            self._follow(done, block.evaluations)
        return min(max(LEAST, pace.steps // (2 * STRETCHES)), super()._next_steps(steps, seconds))

    def _follow(self, done: float, spent: int) -> None:
        """Choose the tolerance with which what is left costs what may still be spent. done, spent: evaluations of the first run
        up to here, and of this one."""
        pace, rtol = self.kept_to, self.used[-1]
        new = ((spent - self.spent) * pace.easier(rtol), done - self.done)
        self.seen = [KEPT * x + y for x, y in zip(self.seen, new, strict=True)]
        self.done, self.spent = done, spent
        left, may = pace.evaluated[-1] - done, max(pace.most - spent, 1e-3 * pace.most)
        dear = self.seen[0] / self.seen[1] * left / may
        if dear > pace.easier(pace.loosest) and spent < self.given_up * pace.evaluated[-1]:
            raise _GivenUp
        by = dear / pace.easier(rtol)
        if abs(by - 1.0) < DEAD or left * STRETCHES < pace.evaluated[-1]:
            return
        wanted = rtol * float(np.clip(by**pace.order, TIGHTER, LOOSER))
        self.used.append(float(np.clip(wanted, pace.tightest, pace.loosest)))
        self.model.block.configure(replace(self.settings, rtol=self.used[-1]))
