"""A run with its error: carried out twice, and compared."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from engine.kernel.columns import columns, select
from engine.scene.model import Scene
from engine.simulation.block import Settings
from engine.simulation.certainty.companion import APART_AT_LEAST, companion, higher, order_of, tightest
from engine.simulation.certainty.elsewhere import elsewhere
from engine.simulation.certainty.estimate import certainty
from engine.simulation.certainty.paced import Counted, Paced
from engine.simulation.certainty.stated import Certainty, Promise
from engine.simulation.model import Model
from engine.simulation.result import Result
from engine.simulation.stepping import OneRun, Progress
from engine.system.build import build

FIRST = 0.4
"""Share of the work that the first run is."""
GIVEN_UP = 0.3
"""Evaluations of a run by another method up to which it may be given up, over those of the first run."""
MOST = 1.4
"""Evaluations of the tighter run over those of the first; a little more comes to 1.5."""
LEAST = 1.15
"""The same where another has been given up before it."""
LIMIT, SMALL = 1.46, 2000
"""The same at which it is stopped (the call that comes to it ends a little later), and evaluations of runs that take no time
whatever they cost."""
BEYOND = 1.05
"""Part of the time to the end of a run that ended early, at which the tighter one ends."""
STATE = ("*.q[*]", "*.qd[*]")
"""Columns that both runs have beside those asked for: where errors grow is seen in the motion."""


def prepared(scene: Scene, patterns: tuple[str, ...], kernel: str | None) -> Model:
    """A model that shows its state beside the columns asked for."""
    if not patterns:
        return Model(scene, patterns, kernel)
    everything = columns(build(scene).system)
    return Model(scene, (*patterns, *(p for p in STATE if select(everything, (p,)))), kernel)


def compared(
    model: Model, until: float, every: float, settings: Settings, progress: Progress | None = None, limited: bool = True
) -> Result:
    """Carry out a run and a tighter one of a model that shows its state; the first with its ``certainty``. limited: the tighter one
    is stopped where it would cost more than half as much again."""
    first = Counted(model, until, every, settings, _part(progress, 0.0))
    run = first.result()
    if run.outcome.name == "stopped" or len(run) == 0 or run.stats.steps == 0:
        return replace(run, certainty=_none(run))
    other = model if settings.step > 0.0 else elsewhere(model, until, run, first.times())
    ends = until if run.outcome.ok else min(until, BEYOND * run.outcome.time)
    second = _Second(other, ends, every, settings, first, run, _part(progress, FIRST), limited).result()
    tighter = second.result
    if len(tighter) == 0:
        return replace(run, certainty=_none(run))
    stated = certainty(run, tighter, model.built.numbers, second.correction)
    if second.cut and stated.promise.why == "stopped":
        stated = replace(stated, promise=replace(stated.promise, why="cost"))
    cost = (run.stats.rhs_evaluations + second.spent + tighter.stats.rhs_evaluations) / max(run.stats.rhs_evaluations, 1)
    stated = replace(stated, rtol=tighter.settings["rtol"], method=tighter.settings["method"], cost=cost)
    return replace(run, certainty=stated, notes=(*run.notes, *notes(stated)))


@dataclass(frozen=True)
class Tighter:
    """The run that a first one is compared with. correction: by how much the difference is to be enlarged for the error of this
    one; spent: evaluations of another that was given up; cut: whether it was stopped since it cost more than it may."""

    result: Result
    correction: float
    spent: int = 0
    cut: bool = False


@dataclass(frozen=True)
class _Second:
    """Makes it. model: that of this run; first, run: the first one and its result."""

    model: Model
    until: float
    every: float
    settings: Settings
    first: Counted
    run: Result
    progress: Progress | None
    limited: bool

    def result(self) -> Tighter:
        """By a method of higher order where that will do, else by its own."""
        s, spent = self.settings, 0
        if (other := higher(s)) is not None:
            tighter = self._paced(other, 0, (other.rtol, s.rtol / APART_AT_LEAST), GIVEN_UP)
            if (result := tighter.carried_out()) is not None:
                return Tighter(result, tighter.correction(s.rtol), 0, tighter.cut)
            spent = tighter.spent
        chosen, correction = companion(s, self.run.stats.counters)
        if chosen.step > 0.0 or chosen.rtol >= s.rtol:
            return Tighter(OneRun(self.model, self.until, self.every, chosen, self.progress).result(), correction, spent)
        tighter = self._paced(chosen, spent, (tightest(s, chosen), s.rtol / APART_AT_LEAST))
        return Tighter(tighter.result(), tighter.correction(s.rtol), spent, tighter.cut)

    def _paced(self, chosen: Settings, spent: int, tolerances: tuple[float, float], given_up: float = 0.0) -> Paced:
        """A run as tight as its cost allows. tolerances: the tightest and the loosest."""
        first = self.run.stats.rhs_evaluations
        limit = LIMIT * max(first, SMALL) - spent if self.limited else np.inf
        most = (max(MOST * first - spent, LEAST * first), limit)
        pace = self.first.pace(self.run, most, order_of(chosen, self.run.stats.counters), tolerances)
        return Paced(self.model, self.until, self.every, chosen, self.progress, pace=pace, given_up=given_up)


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
