"""Measured runs (times, curves, noise), checks of these runs, and their differences from the fitted model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.interface.output_columns import columns
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.name_suggestions import closest
from trunnion.system.construction.system_builder import build

EVEN_SPACING = 1e-9
"""Times count as evenly spaced if the deviations of their spacings, relative to the last time, are below this value."""
LARGEST = 1e100
"""Largest allowed size of a measured value. The squares of values must be finite."""


@dataclass(frozen=True)
class MeasuredRun:
    """A measured run.

    Attributes:
        time: n times, s, evenly spaced from 0.
        curves: measured columns (n) by column name, SI units.
        overrides: numbers of the scene that differ in this run, such as its start, {path: value}.
        noise: standard deviation of the curves, SI units: one value for all, or {column name: value}; None means estimated.
        name: name of the run; default: "run" and its number.
    """

    time: np.ndarray
    curves: Mapping[str, np.ndarray]
    overrides: Mapping[str, Any] = field(default_factory=dict)
    noise: float | Mapping[str, float] | None = None
    name: str = ""

    @property
    def until(self) -> float:
        """The last time, s."""
        return float(self.time[-1])

    @property
    def every(self) -> float:
        """The spacing of the times, s."""
        return float(np.diff(self.time).mean())

    def deviations(self) -> dict[str, float] | None:
        """The given noise of each curve, SI units; None if the noise is to be estimated."""
        if self.noise is None:
            return None
        return {c: float(self.noise[c] if isinstance(self.noise, Mapping) else self.noise) for c in self.curves}


@dataclass(frozen=True)
class CurveComparison:
    """Curves of a measured run beside those of the fitted model, in SI units.

    Attributes:
        name: name of the run.
        time: the n times, s.
        measured: measured curves (n) by column name.
        model: curves of the model (n) by column name.
        noise: standard deviation of the noise of each column, given or estimated.
    """

    name: str
    time: np.ndarray
    measured: Mapping[str, np.ndarray]
    model: Mapping[str, np.ndarray]
    noise: Mapping[str, float]


def normalise_runs(scene: Scene, runs: Sequence[MeasuredRun]) -> list[MeasuredRun]:
    """The runs as arrays with distinct names. SceneError lists every problem of the runs."""
    if not runs:
        raise SceneError([Problem("runs", "no run is given", "give time and measured curves")])
    named = [
        replace(r, time=np.asarray(r.time, float), curves={k: np.asarray(v, float) for k, v in r.curves.items()},
                name=r.name or f"run {i + 1}")
        for i, r in enumerate(runs)
    ]  # fmt: skip
    units = {c.name: c.unit for c in columns(build(scene).system) if c.quantity.smooth}
    problems = [p for r in named for p in _run_problems(r, units, r.name if len(named) > 1 else "")]
    twice = sorted({r.name for r in named if sum(r.name == s.name for s in named) > 1})
    problems += [Problem("runs", f"two runs are called {n}", "give each run a different name") for n in twice]
    if 0 < sum(r.noise is not None for r in named) < len(named):
        problems.append(Problem("noise", "is given for only some of the runs", "give it for all runs, or for none"))
    raise_problems(problems)
    return named


def _run_problems(r: MeasuredRun, units: Mapping[str, str], name: str) -> list[Problem]:
    time = r.time
    where = f"{name}, " if name else ""
    found = []
    if not r.curves:
        found.append(Problem(f"{where}measured", "no curve is given", "give at least one column"))
    step = np.diff(time)
    if (
        len(time) < 2
        or abs(time[0]) > 1e-12
        or not np.abs(step - step.mean()).max() <= EVEN_SPACING * time[-1]
        or not step.mean() > 0.0
    ):
        found.append(Problem(f"{where}time", "is not evenly spaced from 0", "resample the curves"))
    for k, v in r.curves.items():
        if len(v) != len(time):
            found.append(Problem(f"{where}measured", f"{k} has {len(v)} values for {len(time)} times"))
        elif not (np.abs(v) < LARGEST).all():
            found.append(Problem(f"{where}measured", f"{k} has values that are not finite numbers", "leave gaps out, or fill them"))
        if k not in units:
            near = closest(k, list(units))
            hint = f"did you mean {near}?" if near else "see `trunnion check SCENE --columns` for the names"
            found.append(Problem(f"{where}measured", f"{k} is not a column with a derivative", hint))
    if isinstance(r.noise, Mapping) and (absent := [c for c in r.curves if c not in r.noise]):
        hint = "give a standard deviation for every curve"
        found.append(Problem(f"{where}noise", f"no noise is given for {', '.join(absent)}", hint))
    elif r.noise is not None and not all(0.0 < s < np.inf for s in (r.deviations() or {}).values()):
        found.append(Problem(f"{where}noise", "must be positive", "give the standard deviation of each curve, in its unit"))
    return found


def curve_units(scene: Scene, runs: Sequence[MeasuredRun]) -> list[str]:
    """The unit of every curve, in the order of the runs and of their curves."""
    units = {c.name: c.unit for c in columns(build(scene).system)}
    return [units[k] for r in runs for k in r.curves]
