"""Measured runs: their times, curves and noise, and what was different from the scene in each; every mistake in them at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.kernel.columns import columns
from engine.scene.model import Scene
from engine.scene.suggest import closest
from engine.system.build import build

EVEN = 1e-9
"""Spread of the spacings, of the last time, up to which times count as evenly spaced."""
LARGEST = 1e100
"""What is no measurement: its square has to be a number."""


@dataclass(frozen=True)
class Measured:
    """A measured run. time (n): s, evenly spaced from 0; curves (n each): by column name, SI; overrides: numbers of the scene that
    were different in this run (its start, the value of an input); noise: standard deviation of the curves, one for all or by
    column name, or None where it is to be estimated; name: what the run is called, by its place where none is given."""

    time: np.ndarray
    curves: Mapping[str, np.ndarray]
    overrides: Mapping[str, Any] = field(default_factory=dict)
    noise: float | Mapping[str, float] | None = None
    name: str = ""

    @property
    def until(self) -> float:
        """Its last time, s."""
        return float(self.time[-1])

    @property
    def every(self) -> float:
        """The spacing of its times, s."""
        return float(np.diff(self.time).mean())

    def deviations(self) -> dict[str, float] | None:
        """The noise given of each curve; None where it is to be estimated."""
        if self.noise is None:
            return None
        return {c: float(self.noise[c] if isinstance(self.noise, Mapping) else self.noise) for c in self.curves}


def measured_runs(scene: Scene, runs: Sequence[Measured]) -> list[Measured]:
    """The runs as arrays, each with a name of its own. SceneError with everything that is wrong with them."""
    if not runs:
        raise SceneError([Problem("runs", "none is given", "give time and measured curves")])
    named = [
        replace(r, time=np.asarray(r.time, float), curves={k: np.asarray(v, float) for k, v in r.curves.items()},
                name=r.name or f"run {i + 1}")
        for i, r in enumerate(runs)
    ]  # fmt: skip
    units = {c.name: c.unit for c in columns(build(scene).system) if c.quantity.smooth}
    problems = [p for r in named for p in _problems(r, units, r.name if len(named) > 1 else "")]
    twice = sorted({r.name for r in named if sum(r.name == s.name for s in named) > 1})
    problems += [Problem("runs", f"two runs are called {n}", "give each a name of its own") for n in twice]
    if 0 < sum(r.noise is not None for r in named) < len(named):
        problems.append(Problem("noise", "is given for some runs only", "give it for all, or for none and have it estimated"))
    if problems:
        raise SceneError(problems)
    return named


def _problems(r: Measured, units: Mapping[str, str], name: str) -> list[Problem]:
    time = r.time
    where = f"{name}, " if name else ""
    found = []
    if not r.curves:
        found.append(Problem(f"{where}measured", "no curve is given", "give at least one column"))
    step = np.diff(time)
    if len(time) < 2 or abs(time[0]) > 1e-12 or not np.abs(step - step.mean()).max() <= EVEN * time[-1] or not step.mean() > 0.0:
        found.append(Problem(f"{where}time", "is not evenly spaced from 0", "resample the curves"))
    for k, v in r.curves.items():
        if len(v) != len(time):
            found.append(Problem(f"{where}measured", f"{k} has {len(v)} values for {len(time)} times"))
        elif not (np.abs(v) < LARGEST).all():
            found.append(Problem(f"{where}measured", f"{k} has values that are no numbers", "leave gaps out, or fill them"))
        if k not in units:
            near = closest(k, list(units))
            hint = f"did you mean {near}?" if near else "see `trunnion check SCENE --outputs` for the names"
            found.append(Problem(f"{where}measured", f"{k} is no column that has a derivative", hint))
    if isinstance(r.noise, Mapping) and (absent := [c for c in r.curves if c not in r.noise]):
        hint = "give a standard deviation for every curve"
        found.append(Problem(f"{where}noise", f"none is given for {', '.join(absent)}", hint))
    elif r.noise is not None and not all(0.0 < s < np.inf for s in (r.deviations() or {}).values()):
        found.append(Problem(f"{where}noise", "must be positive", "give the standard deviation of each curve, in its unit"))
    return found


def units_of(scene: Scene, runs: Sequence[Measured]) -> list[str]:
    """The unit of every curve, in the order of the runs and of their curves."""
    units = {c.name: c.unit for c in columns(build(scene).system)}
    return [units[k] for r in runs for k in r.curves]
