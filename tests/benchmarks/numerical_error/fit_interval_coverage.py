"""Share of 95 % intervals of fits that contain the true value: ``python -m tests.benchmarks.numerical_error.fit_interval_coverage
[SETS [LEVEL]]``.

The measurements are synthetic, with Gaussian noise. Four mechanisms with dry friction stop and stick while they are measured. These
are a pendulum on a journal, a block that slides to rest, a block on a spring that comes to rest off its middle, and two swings with
unknown starts. ``trunnion.fit`` fits each set. The script prints the share of intervals that contain the true value, for local and
for profile intervals, each with its standard error. It also prints the number of intervals without an end. 1,000 sets take 20 to 40
minutes of one core."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import trunnion
from trunnion.analysis.fits.parameter_estimation import make_objective, solve

PENDULUM: dict[str, Any] = {
    "schema": 1,
    "gravity": [0, -9.81, 0],
    "bodies": {"arm": {"box": [0.4, 0.04, 0.02], "density": 7800, "center": [0.18, 0, 0]}},
    "joints": {
        "pivot": {
            "type": "revolute", "axis": "z", "inboard": "ground", "outboard": "arm", "damping": 0.05,
            "friction": {"mu": 0.25, "radius": "30 mm", "half_length": "15 mm"}, "start": {"q": 0.3, "qd": 0},
        }
    },
}  # fmt: skip
SLIDE: dict[str, Any] = {
    "schema": 1,
    "gravity": [0, 0, -9.81],
    "bodies": {"block": {"box": [0.1, 0.1, 0.1], "density": 1000}},
    "joints": {
        "guide": {
            "type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "block",
            "friction": {"mu": 0.2, "half_length": "50 mm", "half_width": "50 mm", "half_height": "50 mm"},
            "start": {"q": 0, "qd": 1.0},
        }
    },
}  # fmt: skip
MU, RUB = "joints.pivot.friction.mu", "joints.guide.friction.mu"


@dataclass(frozen=True)
class Case:
    """A mechanism to measure: parameters fitted for all runs together, and parameters fitted for each run. Runs (overrides of
    each), column, times and noise; whether the fit receives the noise."""

    scene: Mapping[str, Any]
    shared: Sequence[str]
    column: str
    until: float
    count: int
    noise: float
    own: Sequence[str] = ()
    runs: Sequence[Mapping[str, Any]] = ({},)
    given: bool = False
    changes: Mapping[str, Any] = field(default_factory=dict)


SPRING = {"joints.guide.spring": {"stiffness": 60.0, "rest": 0.0}, "joints.guide.start.qd": 0.0, "joints.guide.start.q": 0.25}
CASES = {
    "pendulum to rest": Case(PENDULUM, (MU, "joints.pivot.damping"), "pivot.q[1]", 3.0, 61, 0.01),
    "block to rest": Case(SLIDE, (RUB, "joints.guide.start.qd"), "guide.q[1]", 1.0, 13, 0.02, given=True),
    "block on a spring": Case(SLIDE, (RUB, "joints.guide.spring.stiffness"), "guide.q[1]", 2.0, 41, 0.01, changes=SPRING),
    "two swings": Case(
        PENDULUM, (MU, "joints.pivot.damping"), "pivot.q[1]", 2.0, 31, 0.01, ("joints.pivot.start.q",),
        ({"joints.pivot.start.q": 0.3}, {"joints.pivot.start.q": -0.4}),
    ),
}  # fmt: skip


class Bench:
    """A prepared case: the curves of its true parameters, to which noise is added repeatedly."""

    def __init__(self, case: Case):
        self.case = case
        self.scene = _scene(case)
        time = np.linspace(0.0, case.until, case.count)
        noise = case.noise if case.given else None
        runs = [trunnion.MeasuredRun(time, {case.column: np.zeros(case.count)}, dict(o), noise) for o in case.runs]
        self.objective = make_objective(self.scene, case.shared, case.own, runs, 1e-8)
        self.truth = self.objective.start
        self.curves = self.objective.curves
        self.exact = self.curves.values(self.truth)
        self.bare = list(self.curves.runs)

    def fitted(self, seed: int, level: float) -> trunnion.Fit:
        """The fit of one set of noisy curves."""
        noisy = self.exact + self.case.noise * np.random.default_rng(seed).normal(size=len(self.exact))
        parts = np.split(noisy, len(self.bare))
        self.curves.runs = [replace(r, curves={self.case.column: p}) for r, p in zip(self.bare, parts, strict=True)]
        o = self.objective
        return solve(self.scene, type(o)(self.curves, o.known, o.start, o.groups), level, True)


def _scene(case: Case) -> trunnion.Scene:
    from trunnion.scene.overrides import scene_given

    return scene_given(case.scene, dict(case.changes) or None)


@dataclass
class Tally:
    """Counts of a case, or of all cases: intervals, intervals that contain the true value (local and by profile), and missing ends.
    shares: for each set, the shares of local and profile intervals that contain the true value."""

    sets: int = 0
    intervals: int = 0
    local: int = 0
    profile: int = 0
    ends: int = 0
    shares: list[tuple[float, float]] = field(default_factory=list)

    def add(self, found: trunnion.Fit, truth: np.ndarray) -> None:
        """Count one fit."""
        self.sets += 1
        before = self.local, self.profile
        for value, i in zip(truth, found.intervals.values(), strict=True):
            self.intervals += 1
            self.local += i.local[0] <= value <= i.local[1]
            self.profile += (i.low <= value or i.low_end != "found") and (value <= i.high or i.high_end != "found")
            self.ends += (i.low_end != "found") + (i.high_end != "found")
        self.shares.append(((self.local - before[0]) / len(truth), (self.profile - before[1]) / len(truth)))

    def line(self, name: str) -> str:
        """The counts as text. The standard errors follow from the shares of the sets, because the intervals of one set are
        correlated."""
        shares = [100.0 * x / max(self.intervals, 1) for x in (self.local, self.profile)]
        errors = 100.0 * np.std(self.shares, axis=0) / np.sqrt(max(self.sets, 1))
        told = "   ".join(f"{s:5.1f} ± {e:.1f}" for s, e in zip(shares, errors, strict=True))
        return f"{name:20s} {self.sets:5d} {self.intervals:6d}   {told}   {self.ends:5d}"


HEAD = f"{'mechanism':20s} {'sets':>5s} {'inter-':>6s}   {'local, %':>11s}   {'profile, %':>11s}   {'no end':>5s}"


def covered(sets: int, level: float = 0.95, first: int = 0, told: int = 0) -> dict[str, Tally]:
    """Tallies of every case and of all cases, over ``sets`` sets, each mechanism in turn. told: number of sets between two printed
    reports."""
    benches = {n: Bench(c) for n, c in CASES.items()}
    tallies = {n: Tally() for n in [*CASES, "all"]}
    for seed in range(first, first + sets):
        name = list(CASES)[seed % len(CASES)]
        found = benches[name].fitted(seed, level)
        for n in (name, "all"):
            tallies[n].add(found, benches[name].truth)
        if told and (seed - first + 1) % told == 0:
            print(tallies["all"].line("so far"), flush=True)
    return tallies


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    sets = int(arguments[0]) if arguments else 1000
    level = float(arguments[1]) if len(arguments) > 1 else 0.95
    print(HEAD, flush=True)
    tallies = covered(sets, level, told=50)
    print("\n".join([HEAD, *(t.line(n) for n, t in tallies.items())]))


if __name__ == "__main__":
    main(sys.argv[1:])
