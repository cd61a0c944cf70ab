"""Runs whose error is asked for: stated with ``certify``, or, with ``accuracy``, below a bound that chooses the tolerance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.kernel.columns import Column, select
from engine.scene.given import Amount
from engine.scene.model import Scene
from engine.scene.units import UnitError, parse, parse_unit
from engine.simulation.block import Settings
from engine.simulation.certainty.certified import compared, prepared
from engine.simulation.certainty.kinds import SMOOTH, kinds
from engine.simulation.model import Model
from engine.simulation.result import Result
from engine.simulation.stepping import Progress

MOTION = ("m", "rad")
"""Units of the columns that an accuracy without a unit is about: positions and angles of the motion."""
FIRST = 0.1
"""Tolerance of the first try, over the accuracy as a part of the scene's scale."""
AIM = 0.5
"""Part of the accuracy that the next try aims at: errors go as the tolerance."""
LEAP = 0.01
"""By how much the tolerance is changed at most from one try to the next."""
TRIES = 6
SPARE = 0.01
"""Part of the accuracy below which errors are so small (motion that drives and loops give) that a looser run is tried."""
TIGHTEST, LOOSE, LOOSEST = 1e-13, 1e-3, 1e-2
"""Tolerances tried: the tightest, the loosest at first, and the loosest of all."""


@dataclass(frozen=True)
class Bound:
    """What is asked of errors. value: the largest, in SI units; text: as it was written; places: of the columns it is about."""

    value: float
    text: str
    places: tuple[int, ...]

    def share(self, result: Result) -> float:
        """The largest error of these columns over what is asked; infinity where not all of the run has one."""
        c = result.certainty
        if c is None or not c.promise.whole or not result.outcome.ok:
            return np.inf
        errors = c.error[:, list(self.places)]
        return float(np.nanmax(errors, initial=0.0)) / self.value


@dataclass(frozen=True)
class Wanted:
    """A run whose error is wanted: until, every, s; accuracy: bound of the errors as it was given, None: any; tolerance: whether a
    tolerance was given too."""

    until: float
    every: float
    settings: Settings
    accuracy: Amount | None = None
    tolerance: bool = False

    def check(self) -> None:
        """SceneError with everything that cannot be."""
        problems = []
        if self.every <= 0.0:
            problems.append(Problem("every", "errors are stated at times that two runs share", "give a spacing, such as 10 ms"))
        if self.accuracy is not None and (self.tolerance or self.settings.step > 0.0):
            problems.append(Problem("accuracy", "it chooses the tolerance itself", "leave rtol and step out"))
        if problems:
            raise SceneError(problems)


def stated(scene: Scene, patterns: tuple[str, ...], kernel: str | None, w: Wanted, progress: Progress | None = None) -> Result:
    """Run a scene with its error. SceneError for what cannot be asked."""
    w.check()
    model = prepared(scene, patterns, kernel)
    if w.accuracy is None:
        return compared(model, w.until, w.every, w.settings, progress).keeping(patterns)
    return searched(model, w, bound_of(w.accuracy, model.columns, patterns), progress).keeping(patterns)


def bound_of(accuracy: Amount, columns: list[Column], patterns: tuple[str, ...]) -> Bound:
    """The bound that a number, or a number with a unit, sets on the errors of the columns asked for."""
    text = f"{accuracy:g}" if isinstance(accuracy, float | int) else str(accuracy)
    try:
        value, unit, written = parse(text)
    except UnitError as e:
        raise SceneError([Problem("accuracy", e.what, e.hint)]) from e
    units = [u for u in {c.unit for c in columns} if (u in MOTION if unit is None else parse_unit(u).dimension == unit.dimension)]
    chosen = {c.name for c in select(columns, patterns) if _errs(c) and (unit is not None or c.quantity.name in SMOOTH)}
    places = tuple(i for i, c in enumerate(columns) if c.unit in units and c.name in chosen)
    if value <= 0.0:
        raise SceneError([Problem("accuracy", f"{text} is not positive", "such as 1e-6, or '1e-6 m'")])
    if not places:
        what = f"no column asked for is in {written or ' or '.join(MOTION)}"
        known = ", ".join(sorted({c.unit for c in columns} - {"1"}))
        raise SceneError([Problem("accuracy", what, f"units of the columns: {known}")])
    return Bound(value, text, places)


def _errs(c: Column) -> bool:
    q = c.quantity
    return not (q.steps or q.runtime)


def _stopped(r: Result) -> bool:
    """Whether Ctrl-C ended one of the two runs."""
    return r.outcome.name == "stopped" or (r.certainty is not None and r.certainty.promise.why == "stopped")


def searched(model: Model, w: Wanted, bound: Bound, progress: Progress | None = None) -> Result:
    """The first run that meets the bound, at tolerances that the errors of the ones before suggest; a looser one in its place where
    it meets the bound by far, and that one does, too."""
    scale = float(kinds(model.columns, model.built.numbers).scale[list(bound.places)].max())
    rtol = float(np.clip(FIRST * bound.value / scale, TIGHTEST, LOOSE))
    for _ in range(TRIES):
        found = compared(model, w.until, w.every, replace(w.settings, rtol=rtol), progress, limited=False)
        share = bound.share(found)
        if share <= 1.0 or rtol <= TIGHTEST or _stopped(found):
            break
        rtol = max(rtol * max(AIM / share, LEAP), TIGHTEST)
    if share <= SPARE and rtol < LOOSEST and not _stopped(found):
        looser = min(rtol * AIM / share, LOOSEST) if share > 0.0 else LOOSEST
        other = compared(model, w.until, w.every, replace(w.settings, rtol=looser), progress, limited=False)
        if bound.share(other) <= 1.0 and not _stopped(other):
            found, share = other, bound.share(other)
    stated = found.certainty and replace(found.certainty, asked=bound.text, met=share <= 1.0)
    if share <= 1.0:
        return replace(found, certainty=stated)
    why = f"errors come to {share * bound.value:.2g}" if np.isfinite(share) else "not all of the run has a stated error"
    return replace(found, certainty=stated, notes=(*found.notes, f"the accuracy of {bound.text} is not met: {why}"))
