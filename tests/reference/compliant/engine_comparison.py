"""Comparison of the engine with the compliant model (the judge). The command compares random scenes in which devices interact:

python -m tests.reference.compliant.engine_comparison FAMILY FIRST LAST [UNTIL]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace

import numpy as np

from tests.reference.compliant.friction_laws import NotJudged
from tests.reference.compliant.runs_and_limit import LEVELS, Judged, judged
from trunnion import simulate

SURE = 3.0
"""Allowed difference in multiples of the compliant model's error. Neighbouring extrapolations differ by about one such error."""


@dataclass(frozen=True)
class Comparison:
    """Results of the engine and of the judge. apart: {coordinate: largest difference, at the judge's instants}; beyond: the part of
    this difference above the judge's own errors; outcome: the engine's outcome."""

    judge: Judged
    apart: dict[str, float]
    beyond: dict[str, float]
    outcome: str

    @property
    def worst(self) -> float:
        """The largest difference above the judge's own errors."""
        return max(self.beyond.values())


def compared(scene, until: float | None = None, rtol: float = 1e-7, levels: int = LEVELS) -> Comparison:
    """Coordinates of all joints by the engine and by the judge. If the engine's run ends early, the difference is infinite. The
    judge takes the engine's start rates only where the scene leaves rates open."""
    first = simulate(scene, until=1e-9, every=1e-9, outputs=["*.q[*", "*.qd[*"])
    rates = {n: _first(first, n, "qd") for n in scene.joints}
    judge = judged(without_guesses(scene, first), until, ["*.q[*"], rates=rates, rtol=rtol, levels=levels)
    run = simulate(scene, until=float(judge.time[-1]), every=float(judge.time[1]), rtol=1e-8, outputs=list(judge.values))
    full = run.time[-1] >= judge.time[-1] * (1 - 1e-9)
    apart, beyond = {}, {}
    angles = {c.name for c in run.columns if c.unit == "rad"}
    for name, values in judge.values.items():
        engine = np.interp(judge.time, run.time, np.asarray(run[name])) if full else np.full(len(values), np.inf)
        away = engine - values
        if name in angles and full:  # the judge cannot count turns between instants more than half a turn apart
            away = np.remainder(away + np.pi, 2 * np.pi) - np.pi
        apart[name] = float(np.abs(away).max())
        beyond[name] = float((np.abs(away) - SURE * judge.error[name]).max())
    return Comparison(judge, apart, beyond, str(run.outcome))


def _first(run, joint: str, key: str) -> list[float]:
    """A joint's coordinates or rates at the start of a run."""
    return [float(run[c.name][0]) for c in run.columns if c.name.startswith(f"{joint}.{key}[")]


def without_guesses(scene, run):
    """The scene with the start coordinates of a run in place of guesses. (Engine and judge refine guesses differently.)"""
    joints = dict(scene.joints)
    for n, j in joints.items():
        if j.start is not None and j.start.use == "guess":
            joints[n] = replace(j, start=replace(j.start, q=_first(run, n, "q")[0]))
    return replace(scene, joints=joints)


def main(family: str, first: str, last: str, until: str = "0.2") -> None:
    """Print a line for each scene."""
    from tests.reference.scenes.random_device_scenes import crossed

    for seed in range(int(first), int(last)):
        scene = crossed(family, seed)
        try:
            c = compared(scene, min(float(until), scene.simulation.until), 1e-5, 2)
        except NotJudged as refused:
            print(f"{family} {seed}: not judged: {refused}", flush=True)
            continue
        worst = max(c.apart, key=c.apart.get)
        print(f"{family} {seed}: {c.outcome}; apart {c.apart[worst]:.2e} at {worst}, beyond errors {c.worst:.2e}, "
              f"judge's error {c.judge.worst:.2e}, {c.judge.seconds:.1f} s", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(*sys.argv[1:])
