"""The error of a run from its comparison with a tighter run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.interface.output_columns import columns, select
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.execution.run_loop import OneRun, Progress
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.global_error.additional_step_ends import offset_step_ends
from trunnion.simulation.global_error.cost_control import CountedRun, PacedRun
from trunnion.simulation.global_error.error_estimate import certainty
from trunnion.simulation.global_error.tighter_run_settings import APART_AT_LEAST, companion, dominant_order, higher, tightest
from trunnion.simulation.results.error_statement import Certainty, Promise
from trunnion.simulation.results.outcome import CANCELLED
from trunnion.simulation.results.result import Result
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.construction.system_builder import build

FIRST = 0.4
"""Share of the first run in the work of both runs."""
TRIAL = 0.3
"""A second run by another method may be abandoned until it has taken this share of the first run's evaluations."""
MOST = 1.4
"""Target number of evaluations of the tighter run, relative to the first run. The actual number may reach 1.5."""
LEAST = 1.15
"""Smallest target number of evaluations after an abandoned run, relative to the first run."""
LIMIT, SMALL = 1.46, 2000
"""LIMIT: the tighter run is stopped at this number of evaluations, relative to the first run's evaluations. SMALL: the first run is
counted with at least this number of evaluations."""
OVERSHOOT = 1.05
"""End time of the tighter run, relative to the end time of a first run that ended early."""
STATE = ("*.q[*]", "*.qd[*]")
"""Columns of the state. Both runs store these columns, because the estimate of how errors grow needs them."""


def model_with_state(scene: Scene, patterns: tuple[str, ...], kernel: str | None) -> Model:
    """A model with the columns of the patterns and the columns of the state."""
    if not patterns:
        return Model(scene, patterns, kernel)
    everything = columns(build(scene).system)
    return Model(scene, (*patterns, *(p for p in STATE if select(everything, (p,)))), kernel)


def compare_runs(
    model: Model, until: float, every: float, settings: Settings, progress: Progress | None = None, limited: bool = True
) -> Result:
    """Execute a run and a tighter run. Returns the result of the first run, with its ``certainty``.

    model: a result of ``model_with_state``. limited: whether the tighter run stops if it costs more than 1.5 times the first
    run."""
    first = CountedRun(model, until, every, settings, _part(progress, 0.0))
    run = first.result()
    if run.outcome.name == CANCELLED or len(run) == 0 or run.stats.steps == 0:
        return replace(run, certainty=_none(run))
    other = model if settings.step > 0.0 else offset_step_ends(model, until, run, first.times())
    ends = until if run.outcome.ok else min(until, OVERSHOOT * run.outcome.time)
    second = _TighterRun(other, ends, every, settings, first, run, _part(progress, FIRST), limited).result()
    tighter = second.result
    if len(tighter) == 0:
        return replace(run, certainty=_none(run))
    stated = certainty(run, tighter, model.built.numbers, second.correction)
    if second.cut and stated.promise.why == CANCELLED:
        stated = replace(stated, promise=replace(stated.promise, why="cost"))
    cost = (run.stats.rhs_evaluations + second.spent + tighter.stats.rhs_evaluations) / max(run.stats.rhs_evaluations, 1)
    stated = replace(stated, rtol=tighter.settings["rtol"], method=tighter.settings["method"], cost=cost)
    return replace(run, certainty=stated, notes=(*run.notes, *notes(stated)))


@dataclass(frozen=True)
class Tighter:
    """A tighter run.

    Attributes:
        result: result of the tighter run.
        correction: factor on the runs' difference that accounts for the tighter run's own error.
        spent: evaluations of a run that was abandoned before.
        cut: whether the tighter run was stopped at its limit of evaluations.
    """

    result: Result
    correction: float
    spent: int = 0
    cut: bool = False


@dataclass(frozen=True)
class _TighterRun:
    """Executes the tighter run. model: model of the tighter run. first, run: the first run and its result."""

    model: Model
    until: float
    every: float
    settings: Settings
    first: CountedRun
    run: Result
    progress: Progress | None
    limited: bool

    def result(self) -> Tighter:
        """The tighter run, by a method of higher order if the cost stays within the limits, else by the first run's method."""
        s, spent = self.settings, 0
        if (other := higher(s)) is not None:
            tighter = self._paced(other, 0, (other.rtol, s.rtol / APART_AT_LEAST), TRIAL)
            if (result := tighter.result_or_none()) is not None:
                return Tighter(result, tighter.correction(s.rtol), 0, tighter.cut)
            spent = tighter.spent
        chosen, correction = companion(s, self.run.stats.counters)
        if chosen.step > 0.0 or chosen.rtol >= s.rtol:
            return Tighter(OneRun(self.model, self.until, self.every, chosen, self.progress).result(), correction, spent)
        tighter = self._paced(chosen, spent, (tightest(s, chosen), s.rtol / APART_AT_LEAST))
        return Tighter(tighter.result(), tighter.correction(s.rtol), spent, tighter.cut)

    def _paced(self, chosen: Settings, spent: int, tolerances: tuple[float, float], trial: float = 0.0) -> PacedRun:
        """A run with the tightest tolerance that its limit of evaluations allows. tolerances: the tightest and the loosest
        tolerance."""
        first = self.run.stats.rhs_evaluations
        limit = LIMIT * max(first, SMALL) - spent if self.limited else np.inf
        most = (max(MOST * first - spent, LEAST * first), limit)
        pace = self.first.pace(self.run, most, dominant_order(chosen, self.run.stats.counters), tolerances)
        return PacedRun(self.model, self.until, self.every, chosen, self.progress, pace=pace, trial=trial)


def _none(run: Result) -> Certainty:
    """The certainty without any stated error, for a cancelled run, or if one of the two runs did not start."""
    width = len(run.columns)
    error, floor = np.full((len(run), width), np.nan), np.full(width, np.nan)
    names, units = tuple(c.name for c in run.columns), tuple(c.unit for c in run.columns)
    return Certainty(names, units, error, np.zeros(len(run)), (np.nan,) * len(run.events), floor, Promise(0.0, "start"))


def notes(stated: Certainty) -> list[str]:
    """A note about the time from which no error is stated; empty if errors are stated to the end."""
    p = stated.promise
    if p.whole:
        return []
    grows = f"; before this time, errors doubled every {p.doubling:.3g} s" if p.doubling < np.inf else ""
    return [f"{p}{grows}"]


def _part(progress: Progress | None, done: float) -> Progress | None:
    """Converts the progress of one run to the progress of both runs. done: share of the work before this run."""
    if progress is None:
        return None
    share = FIRST if done == 0.0 else 1.0 - FIRST
    return lambda time, until: progress(done * until + share * time, until)
