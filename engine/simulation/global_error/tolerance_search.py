"""Runs with error estimates. ``certify`` states the error of a run; ``accuracy`` chooses the tolerance that meets a bound of the
error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.interface.output_columns import Column, select
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.units.python_arguments import Amount
from trunnion.scene.units.unit_parser import UnitError, parse, parse_unit
from trunnion.simulation.execution.run_loop import Progress
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.global_error.column_error_kinds import SMOOTH, kinds
from trunnion.simulation.global_error.two_run_comparison import compare_runs, model_with_state
from trunnion.simulation.results.outcome import CANCELLED
from trunnion.simulation.results.result import Result
from trunnion.simulation.runtime_interface.simulation_block import Settings

MOTION = ("m", "rad")
"""Units of the columns to which an accuracy without a unit applies: positions and angles of the motion."""
FIRST = 0.1
"""First tolerance, relative to accuracy / scale of the columns."""
AIM = 0.5
"""Target of the next run's error, relative to the accuracy. The search assumes errors proportional to the tolerance."""
LEAP = 0.01
"""Smallest ratio of a run's tolerance to that of the previous run."""
TRIES = 6
SPARE = 0.01
"""If the error, relative to the accuracy, is below this value, a run at a looser tolerance is tried. Such small errors occur if
drives and loops prescribe the motion."""
TIGHTEST, LOOSE, LOOSEST = 1e-13, 1e-3, 1e-2
"""TIGHTEST: tightest tolerance of a run. LOOSE: loosest tolerance of the first run. LOOSEST: loosest tolerance of any run."""


@dataclass(frozen=True)
class Bound:
    """A bound of errors. value: largest allowed error, SI units; text: the bound as written; places: indices of the columns to
    which the bound applies."""

    value: float
    text: str
    places: tuple[int, ...]

    def share(self, result: Result) -> float:
        """The largest error of these columns divided by the bound; infinite if a part of the run has no stated error."""
        c = result.certainty
        if c is None or not c.promise.whole or not result.outcome.ok:
            return np.inf
        errors = c.error[:, list(self.places)]
        return float(np.nanmax(errors, initial=0.0)) / self.value


@dataclass(frozen=True)
class ErrorRequest:
    """A request for a run with an error estimate. until, every: s. accuracy: bound of the errors as written; None: no bound.
    tolerance: whether the request also gives a tolerance."""

    until: float
    every: float
    settings: Settings
    accuracy: Amount | None = None
    tolerance: bool = False

    def check(self) -> None:
        """Raise SceneError with every contradiction in the request."""
        problems = []
        if self.every <= 0.0:
            problems.append(
                Problem("every", "an error estimate compares two runs at the same times", "give a spacing of rows, such as 10 ms")
            )
        if self.accuracy is not None and (self.tolerance or self.settings.step > 0.0):
            problems.append(Problem("accuracy", "chooses the tolerance itself", "omit rtol and step"))
        raise_problems(problems)


def run_with_error(
    scene: Scene, patterns: tuple[str, ...], kernel: str | None, w: ErrorRequest, progress: Progress | None
) -> Result:  # fmt: skip
    """Run a scene with an error estimate. Raises SceneError for a wrong request."""
    w.check()
    model = model_with_state(scene, patterns, kernel)
    if w.accuracy is None:
        return compare_runs(model, w.until, w.every, w.settings, progress).keeping(patterns)
    return search_tolerance(model, w, read_bound(w.accuracy, model.columns, patterns), progress).keeping(patterns)


def read_bound(accuracy: Amount, columns: list[Column], patterns: tuple[str, ...]) -> Bound:
    """The bound of errors for the columns that match the patterns. accuracy: a number, or a number with a unit. Raises SceneError
    for a wrong accuracy."""
    text = f"{accuracy:g}" if isinstance(accuracy, float | int) else str(accuracy)
    try:
        value, unit, written = parse(text)
    except UnitError as e:
        raise SceneError([Problem("accuracy", e.what, e.hint)]) from e
    units = [u for u in {c.unit for c in columns} if (u in MOTION if unit is None else parse_unit(u).dimension == unit.dimension)]
    able = (c for c in select(columns, patterns) if not (c.quantity.steps or c.quantity.runtime))
    chosen = {c.name for c in able if (unit is not None or c.quantity.name in SMOOTH)}
    places = tuple(i for i, c in enumerate(columns) if c.unit in units and c.name in chosen)
    if value <= 0.0:
        raise SceneError([Problem("accuracy", f"{text} is not positive", "such as 1e-6, or '1e-6 m'")])
    if not places:
        what = f"no output has the unit {written or ' or '.join(MOTION)}"
        known = ", ".join(sorted({c.unit for c in columns} - {"1"}))
        raise SceneError([Problem("accuracy", what, f"units of the outputs: {known}")])
    return Bound(value, text, places)


def _cancelled(r: Result) -> bool:
    """Whether Ctrl-C ended one of the two compared runs."""
    return r.outcome.name == CANCELLED or (r.certainty is not None and r.certainty.promise.why == CANCELLED)


def search_tolerance(model: Model, w: ErrorRequest, bound: Bound, progress: Progress | None) -> Result:
    """The first run that meets the bound, or the last run if TRIES runs do not meet the bound. Each tolerance follows from the
    errors of the previous run. If the errors are far below the bound, the function tries a looser run, and returns this run if it
    also meets the bound."""
    scale = float(kinds(model.columns, model.built.numbers).scale[list(bound.places)].max())
    rtol = float(np.clip(FIRST * bound.value / scale, TIGHTEST, LOOSE))
    for _ in range(TRIES):
        found = compare_runs(model, w.until, w.every, replace(w.settings, rtol=rtol), progress, limited=False)
        share = bound.share(found)
        if share <= 1.0 or rtol <= TIGHTEST or _cancelled(found):
            break
        rtol = max(rtol * max(AIM / share, LEAP), TIGHTEST)
    if share <= SPARE and rtol < LOOSEST and not _cancelled(found):
        looser = min(rtol * AIM / share, LOOSEST) if share > 0.0 else LOOSEST
        other = compare_runs(model, w.until, w.every, replace(w.settings, rtol=looser), progress, limited=False)
        if bound.share(other) <= 1.0 and not _cancelled(other):
            found, share = other, bound.share(other)
    stated = found.certainty and replace(found.certainty, asked=bound.text, met=share <= 1.0)
    if share <= 1.0:
        return replace(found, certainty=stated)
    why = f"errors reach {share * bound.value:.2g}" if np.isfinite(share) else "a part of the run has no stated error"
    return replace(found, certainty=stated, notes=(*found.notes, f"the accuracy of {bound.text} is not met: {why}"))
