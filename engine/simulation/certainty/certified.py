"""A run with its error: carried out twice, and compared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engine.kernel.columns import columns, select
from engine.scene.model import Scene
from engine.simulation.block import Settings
from engine.simulation.certainty.companion import companion
from engine.simulation.certainty.estimate import certainty
from engine.simulation.certainty.stated import Certainty, Promise
from engine.simulation.model import Model
from engine.simulation.result import Result
from engine.simulation.stepping import OneRun, Progress
from engine.system.build import build

FIRST = 0.4
"""Share of the work that the first run is."""
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
    run = OneRun(model, until, every, settings, _part(progress, 0.0)).result()
    if run.outcome.name == "stopped" or len(run) == 0 or run.stats.steps == 0:
        return replace(run, certainty=_none(run))
    tight, correction = companion(settings, run.stats.counters)
    tighter = OneRun(model, until, every, tight, _part(progress, FIRST)).result()
    if len(tighter) == 0:
        return replace(run, certainty=_none(run))
    stated = certainty(run, tighter, model.built.numbers, correction)
    cost = (run.stats.rhs_evaluations + tighter.stats.rhs_evaluations) / max(run.stats.rhs_evaluations, 1)
    stated = replace(stated, rtol=tight.rtol, method=tight.method, cost=cost)
    return replace(run, certainty=stated, notes=(*run.notes, *notes(stated)))


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
