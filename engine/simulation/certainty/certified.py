"""A run with its error: carried out twice, and compared."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from engine.kernel.columns import columns, select
from engine.scene.model import Scene
from engine.simulation.block import Settings
from engine.simulation.certainty.companion import between, elsewhere, explicit, finer, looser, order_of
from engine.simulation.certainty.estimate import certainty
from engine.simulation.certainty.paced import Counted, Paced
from engine.simulation.certainty.stated import Certainty, Promise
from engine.simulation.model import Model
from engine.simulation.result import Result
from engine.simulation.stepping import OneRun, Progress
from engine.system.build import build

FIRST = 0.4
"""Share of the work that the first run is."""
TRIED, ENDED = 0.05, 0.85
"""Evaluations of a try by another method, and of all of a run by it before it is given up, over those of the first run."""
EACH = 16.0
"""Evaluations of a step of order 8, with those that look for events."""
LEAST = 5
"""Steps that say how far so many more would go."""
MOST = 1.42
"""Evaluations of the tighter run over those of the first; a little more comes to 1.5."""
STATE = ("*.q[*]", "*.qd[*]")
"""Columns that both runs have beside those asked for: where errors grow is seen in the motion."""


def prepared(scene: Scene, patterns: tuple[str, ...], kernel: str | None) -> Model:
    """A model that shows its state beside the columns asked for."""
    if not patterns:
        return Model(scene, patterns, kernel)
    everything = columns(build(scene).system)
    return Model(scene, (*patterns, *(p for p in STATE if select(everything, (p,)))), kernel)


def compared(model: Model, until: float, every: float, settings: Settings, progress: Progress | None = None) -> Result:
    """Carry out a run and a tighter one of a model that shows its state; the first with its ``certainty``."""
    first = Counted(model, until, every, settings, _part(progress, 0.0))
    run = first.result()
    if run.outcome.name == "stopped" or len(run) == 0 or run.stats.steps == 0:
        return replace(run, certainty=_none(run))
    other = model if settings.step > 0.0 else elsewhere(model, until, run.stats.steps)
    second = _Second(other, until, every, settings, first, run, _part(progress, FIRST))
    tighter, correction, spent = second.result()
    if len(tighter) == 0:
        return replace(run, certainty=_none(run))
    stated = certainty(run, tighter, model.built.numbers, correction)
    cost = (run.stats.rhs_evaluations + spent + tighter.stats.rhs_evaluations) / max(run.stats.rhs_evaluations, 1)
    stated = replace(stated, rtol=tighter.settings["rtol"], method=tighter.settings["method"], cost=cost)
    return replace(run, certainty=stated, notes=(*run.notes, *notes(stated)))


@dataclass(frozen=True)
class _Second:
    """The run that a first one is compared with. model: that of this run; first, run: the first one and its result."""

    model: Model
    until: float
    every: float
    settings: Settings
    first: Counted
    run: Result
    progress: Progress | None

    def result(self) -> tuple[Result, float, int]:
        """(the tighter run; by how much the difference is to be enlarged; evaluations of others that were given up)."""
        spent, s, other = 0, self.settings, explicit(self.settings)
        most = self.run.stats.rhs_evaluations
        if other is not None and TRIED * most >= LEAST * EACH:
            trial = OneRun(self.model, self.until, 0.0, replace(other[0], max_steps=int(TRIED * most / EACH)), None).result()
            spent = trial.stats.rhs_evaluations
            if trial.outcome.name == "stopped":
                return replace(trial, data=trial.data[:0]), 1.0, spent
            limit = int(ENDED * most * trial.stats.steps / max(spent, 1))
            limit = min(limit, s.max_steps or limit)
            if _steps_to(self.until, trial.time) <= limit:
                tighter = self._carried_out(replace(other[0], max_steps=limit))
                if tighter.outcome.name != "max_steps":
                    return tighter, other[1], spent
                loose, correction = looser(s)
                return self._carried_out(loose), correction, spent + tighter.stats.rhs_evaluations
        return *self._paced(spent), spent

    def _carried_out(self, settings: Settings) -> Result:
        return OneRun(self.model, self.until, self.every, settings, self.progress).result()

    def _paced(self, spent: int) -> tuple[Result, float]:
        """A run as tight as its cost allows, and by how much the difference is to be enlarged."""
        chosen, correction = finer(self.settings, self.run.stats.counters)
        if chosen.step > 0.0 or chosen.rtol >= self.settings.rtol:
            return self._carried_out(chosen), correction
        order = order_of(chosen, self.run.stats.counters)
        most = MOST * self.run.stats.rhs_evaluations - spent
        pace = self.first.pace(self.run, most, order, between(self.settings, chosen))
        tighter = Paced(self.model, self.until, self.every, chosen, self.progress, pace)
        result = tighter.result()
        return result, 1.0 / (1.0 - max(tighter.used) / self.settings.rtol)


def _steps_to(until: float, times: np.ndarray) -> float:
    """How many steps a run takes to its end that goes on as it did in the second half of these."""
    half = len(times) // 2
    return half + (until - times[half]) / max((times[-1] - times[half]) / max(len(times) - 1 - half, 1), 1e-300) if half else np.inf


def _none(run: Result) -> Certainty:
    """What is stated of a run that was stopped, or where one of the two did not start: nothing."""
    width = len(run.columns)
    error, floor = np.full((len(run), width), np.nan), np.full(width, np.nan)
    names, units = tuple(c.name for c in run.columns), tuple(c.unit for c in run.columns)
    return Certainty(names, units, error, np.zeros(len(run)), (np.nan,) * len(run.events), floor, Promise(0.0, "start"))


def notes(stated: Certainty) -> list[str]:
    """What there is to say of it in a run's notes."""
    p = stated.promise
    if p.whole:
        return []
    grows = f"; before, errors doubled every {p.doubling:.3g} s" if p.doubling < np.inf else ""
    return [f"{p}{grows}"]


def _part(progress: Progress | None, done: float) -> Progress | None:
    """Progress of one of the two runs as that of both."""
    if progress is None:
        return None
    share = FIRST if done == 0.0 else 1.0 - FIRST
    return lambda time, until: progress(done * until + share * time, until)
