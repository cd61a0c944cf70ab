"""Measures a scene with every method, tolerance, step and friction law, and with every installed reference solver."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from trunnion.analysis.work_precision.benchmark_model import (
    MOST_STEPS,
    BenchmarkModel,
    estimate_integration_error,
    exact_law,
    friction_variants,
    make_benchmark_model,
    methods,
    time_repeats,
)
from trunnion.analysis.work_precision.error_measure import make_error_measure
from trunnion.analysis.work_precision.measurement_points import ENGINE, FrictionVariant, Measurement
from trunnion.analysis.work_precision.reference_solution import find_reference
from trunnion.analysis.work_precision.request_and_results import Progress, WorkPrecision, WorkPrecisionRequest
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.runtime_interface.simulation_block import METHODS, Settings

TOLERANCES = tuple(10.0**-k for k in range(2, 13))
FIXED = (8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125)
"""Fixed steps, as multiples of the mean step of the automatic method at rtol 1e-6."""
SLOW_RUN, SLOW_RATIO = 0.1, 3.0
"""If a run takes longer than SLOW_RUN, s, and longer than SLOW_RATIO times the longest reference run, tighter settings of the
method are left out. At such settings, a first-order method would take ten thousand times as long as the others."""
WARM_RUN = 0.05
"""A first run longer than this, s, counts as a repeat. In shorter runs, cold caches matter."""


def measure_work_precision(
    scene: Scene,
    request: WorkPrecisionRequest | None = None,
    progress: Progress = lambda *_: None,
    show: Callable[[list[Measurement]], None] = lambda _: None,
) -> WorkPrecision:
    """Measure a valid scene. A failed run becomes a point with its outcome. Raises SceneError for outputs that do not exist.

    show: called with the points of each method, first with error control, then with fixed steps, as soon as they are measured."""
    request = request or WorkPrecisionRequest()
    measure = make_error_measure(scene, request.outputs, request.norm)
    until = float(request.until or scene.simulation.until)
    laws, notes = friction_variants(scene, request.laws, request.v_eps)
    exact = _exact_variant(scene, laws)
    study = WorkPrecision(scene, request, measure, until, exact, notes=notes)
    ready = {}
    for k, v in enumerate(sorted(laws, key=lambda v: v != exact)):  # the exact law comes first: model errors need its reference
        progress(f"reference {v}".strip(), k, len(laws))
        ready[v] = _make_model(study, v)
        ladders = _settings(study, ready[v])
        total = len(laws) * sum(map(len, ladders))
        for ladder in ladders:
            progress(f"{v} {ladder[0].method}".strip(), k * total // len(laws), total)
            points = _measure_ladder(study, ready[v], ladder)
            study.points += points
            show(points)
    for law in dict.fromkeys(v.law for v in laws):
        study.builds += _build_times(next(ready[v] for v in laws if v.law == law))
    if request.solvers:
        from trunnion.analysis.work_precision.reference_solvers.solver_benchmark import measure_reference_solvers

        measure_reference_solvers(study, ready, progress)
    return study


def _exact_variant(scene: Scene, laws: list[FrictionVariant]) -> FrictionVariant:
    """The variant that serves as reference for model errors: the exact law, or the scene's own law with the smallest v_eps."""
    named = [v for v in laws if v.law == exact_law(scene)] or laws
    return min(named, key=lambda v: v.v_eps)


def _make_model(study: WorkPrecision, v: FrictionVariant) -> BenchmarkModel:
    """Compile the scene with a law, and add the law's reference solution to the study. Returns the compiled scene."""
    out = make_benchmark_model(study.scene, v, study.measure, study.until, study.request.samples)
    found = find_reference(out)
    if found is None:
        study.notes.append(f"{v}: no two methods reach the end at tight tolerance, so no errors are given")
    else:
        study.references[v] = found
    return out


def _build_times(ready: BenchmarkModel) -> list[tuple[str, float]]:
    """Build times (what, s) of a kernel. The kernel's record gives symbolic time and compile time. A new build of its Jacobian unit
    is measured."""
    from trunnion.kernel.shared_libraries import build_jacobian

    facts, law = ready.model.kernel.facts, f" ({ready.variant.law})" if ready.variant.law else ""
    out = [(f"equations{law}", facts["symbolic_seconds"]), (f"compile{law}", facts["compile_seconds"])]
    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        build_jacobian(Path(folder), ready.model.kernel.structure)
        out.append((f"Jacobian{law}, only for stiff methods", time.perf_counter() - started))
    return out


def _settings(study: WorkPrecision, ready: BenchmarkModel) -> list[list[Settings]]:
    """The tolerances of each method, from loose to tight. If the request includes fixed steps, also the fixed steps of each method,
    from long to short."""
    request = study.request
    able = methods(ready.scene)
    chosen = [m for m in able if not request.methods or m in request.methods]
    for m in sorted(METHODS.keys() - able if not request.methods else set(request.methods) - {*able}):
        note = f"law {ready.variant.law}: method {m} left out, since it cannot integrate this law"
        study.notes += [note] if note not in study.notes else []
    out = [[Settings(rtol=r, method=m, max_steps=MOST_STEPS) for r in request.rtols or TOLERANCES] for m in chosen]
    if request.fixed and (mean := _mean_step(ready)):
        steps = [study.until / max(1, math.ceil(study.until / (f * mean))) for f in FIXED]
        out += [[Settings(method=m, step=h, max_steps=MOST_STEPS) for h in steps] for m in chosen if m != "auto"]
    return out


def _mean_step(ready: BenchmarkModel) -> float:
    """Mean step of the automatic method at rtol 1e-6, s; 0 if the run fails."""
    result, outcome = ready.once(Settings(rtol=1e-6, max_steps=MOST_STEPS))
    return ready.until / max(1, result.stats.steps) if result is not None and outcome == "done" else 0.0


def _measure_ladder(study: WorkPrecision, ready: BenchmarkModel, ladder: list[Settings]) -> list[Measurement]:
    """Measure the settings of a method. After a run that is slow compared with the reference, tighter settings are omitted with a
    note, unless the user named the tolerances."""
    limit = max(SLOW_RUN, SLOW_RATIO * max((r.seconds for r in study.references.values()), default=0.0))
    out: list[Measurement] = []
    for n, s in enumerate(ladder, 1):
        out.append(_measure(study, ready, s))
        last = out[-1]
        if last.minimum > limit and n < len(ladder) and (s.step or not study.request.rtols):
            where = f"{ready.variant}, {s.method}" if ready.variant.law else s.method
            study.notes.append(f"{where}: tighter settings than {last.setting}, which takes {last.minimum:.2g} s, were omitted")
            break
    return out


def _measure(study: WorkPrecision, ready: BenchmarkModel, settings: Settings) -> Measurement:
    """Run a setting, repeat the run to measure its time, and compare the result with the references."""
    result, outcome = ready.once(settings)
    rtol = 0.0 if settings.step else settings.rtol
    head = (ENGINE, settings.method, rtol, settings.step, ready.variant.law, ready.variant.v_eps)
    if result is None:
        return Measurement(*head, math.nan, math.nan, math.nan, math.nan, 0, outcome=outcome)
    s = result.stats
    counts = {"steps": s.steps, "rejected": s.rejected, "evaluations": s.rhs_evaluations, "events": s.events, "outcome": outcome}
    if outcome != "done":
        return Measurement(*head, math.nan, math.nan, s.wall_time, s.wall_time, 1, **counts)  # type: ignore[arg-type]
    known = [s.wall_time] if s.wall_time > WARM_RUN else []
    low, middle, count = time_repeats(partial(ready.seconds, settings), study.request.repeats, known)
    counts["predicted"] = estimate_integration_error(ready, settings, result, study.measure)
    errors = study.errors(ready.variant, ready.samples(result))
    return Measurement(*head, *errors, low, middle, count, **counts)  # type: ignore[arg-type]
