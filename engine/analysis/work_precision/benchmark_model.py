"""A scene with one friction law, compiled once and run with any settings. A failed run raises no error: its result states the
failure."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence

import numpy as np

from trunnion.analysis.work_precision.error_measure import ErrorMeasure
from trunnion.analysis.work_precision.measurement_points import FrictionVariant
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.friction import exact_of
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import apply, law_changes
from trunnion.simulation.global_error.error_estimate import SAFETY
from trunnion.simulation.global_error.tighter_run_settings import companion
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import METHODS, Settings
from trunnion.simulation.settings.request_checks import method_problems

MOST_STEPS = 1_000_000
"""Step limit of a measured run. A setting that needs more steps is reported as a failure."""
LIMIT = 2.0
"""Time after which a run is not repeated further, s."""


@dataclass
class BenchmarkModel:
    """A scene compiled with one friction law. until: end of the run, s; every: spacing of samples, s."""

    scene: Scene
    variant: FrictionVariant
    model: Model
    measure: ErrorMeasure
    until: float
    every: float

    def once(self, settings: Settings) -> tuple[Result | None, str]:
        """Run once. Returns the result, or None if the run raises an error, and "done" or the reason of the failure."""
        try:
            result = run(self.model, self.until, self.every, settings)
        except (SceneError, SimulationError) as e:
            return None, str(e)
        return result, "done" if result.outcome.ok else str(result.outcome).split(":")[0]

    def seconds(self, settings: Settings) -> float:
        """Stepping time of a run, s; infinite if the run raises an error."""
        result, _ = self.once(settings)
        return result.stats.wall_time if result is not None else math.inf

    def samples(self, result: Result) -> np.ndarray:
        """The compared columns (samples × columns)."""
        return result.data[:, 1:]


def estimate_integration_error(ready: BenchmarkModel, settings: Settings, result: Result, measure: ErrorMeasure) -> float:
    """The integration error of the result, measured by ``measure`` against a tighter run (theory, "Global error"); NaN if the
    tighter run fails."""
    tight, correction = companion(settings, result.stats.counters)
    other, outcome = ready.once(tight)
    if other is None or outcome != "done":
        return math.nan
    return SAFETY * correction * measure.error(ready.samples(result), ready.samples(other))


def make_benchmark_model(
    scene: Scene, variant: FrictionVariant, measure: ErrorMeasure, until: float, samples: int
) -> BenchmarkModel:
    """Compile a scene with a friction law, and its Jacobian unit, so that no timed run includes a compilation."""
    changed = with_law(scene, variant)
    model = Model(changed, measure.names, runs=math.inf)
    model.block.attach_jacobian()
    return BenchmarkModel(changed, variant, model, measure, until, until / samples)


def with_law(scene: Scene, variant: FrictionVariant) -> Scene:
    """The scene with this friction law in all its joints."""
    if not variant.law:
        return scene
    changes: dict[str, object] = {**law_changes(scene, variant.law)}
    if variant.v_eps:
        own = [n for n, j in scene.joints.items() if j.friction is not None and j.friction.v_eps is not None]
        changes |= dict.fromkeys(("friction.v_eps", *(f"joints.{n}.friction.v_eps" for n in own)), variant.v_eps)
    return apply(scene, changes)


def friction_variants(
    scene: Scene, laws: tuple[str, ...] = (), v_eps: tuple[float, ...] = ()
) -> tuple[list[FrictionVariant], list[str]]:
    """(friction variants whose parameters the scene defines; notes that say why other laws are missing). The exact law comes first.

    laws: names of laws, default all; v_eps: regularisation speeds, m/s, for laws that have one.
    """
    if all(j.friction is None for j in scene.joints.values()):
        return [FrictionVariant()], []
    out, notes = [], []
    order = [exact_law(scene), *sorted(LAWS)]
    for law in dict.fromkeys(laws or order):
        try:
            changed = with_law(scene, FrictionVariant(law))
        except SceneError as e:
            notes.append(f"law {law} left out: {e.problems[0].what}")
            continue
        out += (
            [FrictionVariant(law, v) for v in (v_eps or (1e-2, 1e-3, 1e-4, 1e-5))] if has_v_eps(changed) else [FrictionVariant(law)]
        )
    return out, notes


def exact_law(scene: Scene) -> str:
    """The law that serves as reference for errors: the scene's own law, or the set-valued law that the scene's law regularises."""
    return exact_of(scene.friction.law)


def has_v_eps(scene: Scene) -> bool:
    """Whether the scene's law is regularised with v_eps."""
    from trunnion.system.construction.system_builder import build

    return any(name == "v_eps" for j in build(scene).system.frictional if j.friction for name, _ in j.friction.numbers)


def methods(scene: Scene) -> tuple[str, ...]:
    """Names of all methods that can integrate the scene. The automatic choice comes first."""
    return tuple(sorted((m for m in METHODS if not method_problems(scene, m)), key=lambda m: (m != "auto", METHODS[m])))


def time_repeats(once: Callable[[], float], repeats: int, known: Sequence[float] = ()) -> tuple[float, float, int]:
    """(minimum, median, count) of the seconds that ``once`` returns. known: seconds of earlier runs that count as repeats. After
    three repeats, measuring stops once LIMIT s have passed."""
    times = list(known)
    started = time.perf_counter()
    while len(times) < repeats and (len(times) < min(3, repeats) or time.perf_counter() - started < LIMIT):
        times.append(once())
    return min(times), statistics.median(times), len(times)
