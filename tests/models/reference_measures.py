"""Measures that the ``compute`` entries of a reference.yaml name in words. Columns do not hold these quantities at one given
time."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.results.event import Event
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, run, simulate
from trunnion.simulation.runtime_interface.simulation_block import Settings

Measure = Callable[[Scene, re.Match[str]], float]
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")
SLIDING_ENDS = ("reversal", "stick")


def stops(scene: Scene) -> list[Event]:
    """Events that end sliding, within the scene's own time."""
    return [e for e in simulate(scene).events if e.kind in SLIDING_ENDS]


def which(words: str) -> int:
    """Index of an ordinal; "last" is the last index."""
    return -1 if words == "last" else ORDINALS.index(words)


def turn(e: Event) -> float:
    """Largest angle by which a contact normal turns at the event, degrees."""
    return float(np.degrees(np.abs(np.subtract(e.after, e.before)).max()))


def time_of_stop(scene: Scene, m: re.Match[str]) -> float:
    """Time of the stop that the words name, s."""
    return stops(scene)[which(m[1])].time


def turn_at_stop(scene: Scene, m: re.Match[str]) -> float:
    """Turn of the contact normal at the stop that the words name, degrees."""
    return turn(stops(scene)[which(m[1])])


def turn_at_time(scene: Scene, m: re.Match[str]) -> float:
    """Angle by which the contact normals turn at an event, degrees. The event is the one nearest to t = n π/m, the time in the
    words."""
    t = float(m[1] or 1) * np.pi / float(m[2])
    return turn(min(simulate(scene, until=1.2 * t).events, key=lambda e: abs(e.time - t)))


def largest(scene: Scene, m: re.Match[str]) -> float:
    """Largest magnitude of a joint's rate. A rough run finds the step with the largest rate. Further runs to times near this step
    refine the value."""
    model, column = Model(scene, (f"{m[1]}.qd[1]",)), f"{m[1]}.qd[1]"
    settings = Settings(rtol=float(scene.simulation.rtol))

    rough: Result = run(model, float(scene.simulation.until), 0.0, settings)
    i = int(np.argmax(np.abs(rough[column][: len(rough) // 2])))
    middle, before, after = (float(rough.time[k]) for k in (i, i - 1, i + 1))

    def value(later: float) -> float:
        return abs(float(run(model, middle + later, middle + later, settings)[column][-1]))

    bounds = (before - middle, after - middle)
    return value(float(minimize_scalar(lambda x: -value(x), bounds=bounds, method="bounded", options={"xatol": 1e-13}).x))


def solutions_at_start(scene: Scene, m: re.Match[str]) -> float:
    """0 if no solution exists at the start, so that the run ends before its start; else at least 1."""
    outcome = simulate(scene, until=1e-3).outcome
    return 0.0 if (outcome.name, outcome.time) == ("no_solution", 0.0) else 1.0


MEASURES: dict[str, Measure] = {
    r"time of the (\w+) stop\b.*": time_of_stop,
    r"turn of the contact normal at the (\w+) stop in degrees": turn_at_stop,
    r"turn of the contact normals at t = (\d*) ?pi/(\d+) in degrees": turn_at_time,
    r"largest magnitude of (\w+)\.qd over a period": largest,
    r"number of solutions of the complement equations at t = 0 with .*": solutions_at_start,
}


def measured(words: str, scene: Scene) -> float:
    """The number that the words name. LookupError if no measure matches the words."""
    for pattern, measure in MEASURES.items():
        m = re.fullmatch(pattern, words)
        if m:
            return measure(scene, m)
    raise LookupError(f"no measure for {words!r}: add one in tests/models/reference_measures.py")
