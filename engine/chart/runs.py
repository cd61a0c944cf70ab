"""Runs to be measured: a scene with one friction law made ready once, stepped with any settings, failures as results."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from engine.basics.problems import SceneError, SimulationError
from engine.chart.measures import Measure
from engine.chart.points import Variant
from engine.friction import REGISTRY as LAWS
from engine.friction import exact_of
from engine.scene.model import Scene
from engine.scene.overrides import apply
from engine.simulation.block import METHODS, Settings
from engine.simulation.certainty.companion import companion
from engine.simulation.certainty.estimate import SAFETY
from engine.simulation.result import Result
from engine.simulation.run import Model, run

MOST_STEPS = 1_000_000
"""A setting that needs more steps than this is reported as a failure."""


@dataclass
class Prepared:
    """A scene with a law, compiled; ``until`` and ``every`` in s."""

    scene: Scene
    variant: Variant
    model: Model
    measure: Measure
    until: float
    every: float

    def once(self, settings: Settings) -> tuple[Result | None, str]:
        """Run once: (result or None, "done" or what went wrong)."""
        try:
            result = run(self.model, self.until, self.every, settings)
        except (SceneError, SimulationError) as e:
            return None, str(e)
        return result, "done" if result.outcome.ok else str(result.outcome).split(":")[0]

    def samples(self, result: Result) -> np.ndarray:
        """The compared columns, samples × columns."""
        return result.data[:, 1:]


def predicted(ready: Prepared, settings: Settings, result: Result, measure: Measure) -> float:
    """The error that a tighter run states of a result, in the chart's measure; NaN where that run fails."""
    tight, correction = companion(settings, result.stats.counters)
    other, outcome = ready.once(tight)
    if other is None or outcome != "done":
        return math.nan
    return SAFETY * correction * measure.error(ready.samples(result), ready.samples(other))


def prepare(scene: Scene, variant: Variant, measure: Measure, until: float, samples: int) -> Prepared:
    """Compile a scene with the law. The unit of the Jacobian is built here too, so that no timed run pays for it."""
    changed = with_law(scene, variant)
    model = Model(changed, measure.names, runs=math.inf)
    model.block.attach_jacobian()
    return Prepared(changed, variant, model, measure, until, until / samples)


def with_law(scene: Scene, variant: Variant) -> Scene:
    """The scene with this law in all its joints."""
    if not variant.law:
        return scene
    changes: dict[str, object] = {"friction.law": variant.law}
    for name, j in scene.joints.items():
        if j.friction is not None and j.friction.law is not None:
            changes[f"joints.{name}.friction.law"] = variant.law
        if j.friction is not None and j.friction.v_eps is not None and variant.v_eps:
            changes[f"joints.{name}.friction.v_eps"] = variant.v_eps
    if variant.v_eps:
        changes["friction.v_eps"] = variant.v_eps
    return apply(scene, changes)


def frictional(scene: Scene) -> bool:
    """Whether any joint of the scene has friction."""
    return any(j.friction is not None for j in scene.joints.values())


def variants(scene: Scene, laws: tuple[str, ...] = (), v_eps: tuple[float, ...] = ()) -> tuple[list[Variant], list[str]]:
    """Laws (every one built, unless named) that the scene has the numbers for, with their v_eps where they have one; and
    why the others were left out. The exact law, when it is there, comes first."""
    if not frictional(scene):
        return [Variant()], []
    out, notes = [], []
    order = [exact_law(scene), *sorted(LAWS)]
    for law in dict.fromkeys(laws or order):
        try:
            changed = with_law(scene, Variant(law))
        except SceneError as e:
            notes.append(f"law {law} left out: {e.problems[0].what}")
            continue
        out += [Variant(law, v) for v in (v_eps or (1e-2, 1e-3, 1e-4, 1e-5))] if has_v_eps(changed) else [Variant(law)]
    return out, notes


def exact_law(scene: Scene) -> str:
    """The law errors are measured against: the scene's own, and for a smoothed law the set-valued one it smooths."""
    return exact_of(scene.friction.law)


def has_v_eps(scene: Scene) -> bool:
    """Whether the scene's law smooths with v_eps."""
    from engine.system.build import build

    return any(name == "v_eps" for j in build(scene).system.frictional if j.friction for name, _ in j.friction.numbers)


def methods() -> tuple[str, ...]:
    """Every method that can be asked for, the automatic choice first."""
    return tuple(sorted(METHODS, key=lambda m: (m != "auto", METHODS[m])))


def repeated(once: Callable[[], float], repeats: int, patience: float = 2.0) -> tuple[float, float, int]:
    """(minimum, median, count) of the seconds ``once`` reports; stops early (after three) when patience, s, is used up."""
    times: list[float] = []
    started = time.perf_counter()
    while len(times) < repeats and (len(times) < min(3, repeats) or time.perf_counter() - started < patience):
        times.append(once())
    return min(times), statistics.median(times), len(times)
