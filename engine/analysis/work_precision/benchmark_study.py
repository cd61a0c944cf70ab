"""Measures a scene with every method, tolerance, step and friction law, and with every installed reference solver."""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path

from trunnion.analysis.work_precision.benchmark_runs import (
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
from trunnion.simulation.runtime_interface.simulation_block import Settings

TOLERANCES = tuple(10.0**-k for k in range(2, 13))
FIXED = (8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125)
"""Fixed steps, as multiples of the mean step of the automatic method at rtol 1e-6."""


def measure_work_precision(
    scene: Scene, request: WorkPrecisionRequest | None = None, progress: Progress = lambda *_: None
) -> WorkPrecision:
    """Measure a valid scene. A failed run becomes a point with its outcome. SceneError for outputs that do not exist."""
    request = request or WorkPrecisionRequest()
    measure = make_error_measure(scene, request.outputs, request.norm)
    until = float(request.until or scene.simulation.until)
    laws, notes = friction_variants(scene, request.laws, request.v_eps)
    study = WorkPrecision(scene, request, measure, until, _exact_variant(scene, laws), notes=notes)
    ready = _make_models(study, laws, progress)
    settings = {variant: _settings(study, model) for variant, model in ready.items()}
    total = sum(map(len, settings.values()))
    for variant, chosen in settings.items():
        for s in chosen:
            progress(f"{variant} {s.method}".strip(), len(study.points), total)
            study.points.append(_measure(study, ready[variant], s))
    if request.solvers:
        from trunnion.analysis.work_precision.reference_solvers.solver_benchmark import measure_reference_solvers

        measure_reference_solvers(study, ready, progress)
    return study


def _exact_variant(scene: Scene, laws: list[FrictionVariant]) -> FrictionVariant:
    """The variant that serves as reference for model errors: the exact law, or the scene's own law with the smallest v_eps."""
    named = [v for v in laws if v.law == exact_law(scene)] or laws
    return min(named, key=lambda v: v.v_eps)


def _make_models(study: WorkPrecision, laws: list[FrictionVariant], progress: Progress) -> dict[FrictionVariant, BenchmarkModel]:
    """The scene compiled with each law. Adds the references and build times of these models to the study."""
    out = {}
    for k, v in enumerate(laws):
        progress(f"reference {v}".strip(), k, len(laws))
        out[v] = make_benchmark_model(study.scene, v, study.measure, study.until, study.request.samples)
        found = find_reference(out[v])
        if found is None:
            study.notes.append(f"{v}: no two methods reach the end at tight tolerance, so no errors are given")
        else:
            study.references[v] = found
    for law in dict.fromkeys(v.law for v in laws):
        study.builds += _build_times(next(out[v] for v in laws if v.law == law))
    return out


def _build_times(ready: BenchmarkModel) -> list[tuple[str, float]]:
    """Build times (what, s) of a kernel: symbolic time and compile time from the kernel's record, and the measured time of a new
    build of its Jacobian unit."""
    from trunnion.kernel.shared_libraries import build_jacobian

    facts, law = ready.model.kernel.facts, f" ({ready.variant.law})" if ready.variant.law else ""
    out = [(f"equations{law}", facts["symbolic_seconds"]), (f"compile{law}", facts["compile_seconds"])]
    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        build_jacobian(Path(folder), ready.model.kernel.structure)
        out.append((f"Jacobian{law}, only for stiff methods", time.perf_counter() - started))
    return out


def _settings(study: WorkPrecision, ready: BenchmarkModel) -> list[Settings]:
    """Each method at each tolerance. If the request includes fixed steps, also each method with each fixed step."""
    request = study.request
    chosen = [m for m in methods() if not request.methods or m in request.methods]
    out = [Settings(rtol=r, method=m, max_steps=MOST_STEPS) for m in chosen for r in request.rtols or TOLERANCES]
    if request.fixed:
        mean = _mean_step(ready)
        steps = [study.until / max(1, math.ceil(study.until / (f * mean))) for f in FIXED] if mean else []
        out += [Settings(method=m, step=h, max_steps=MOST_STEPS) for m in chosen if m != "auto" for h in steps]
    return out


def _mean_step(ready: BenchmarkModel) -> float:
    """Mean step of the automatic method at rtol 1e-6, s; 0 if the run fails."""
    result, outcome = ready.once(Settings(rtol=1e-6, max_steps=MOST_STEPS))
    return ready.until / max(1, result.stats.steps) if result is not None and outcome == "done" else 0.0


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

    def again() -> float:
        other, _ = ready.once(settings)
        return other.stats.wall_time if other is not None else math.inf

    low, middle, count = time_repeats(again, study.request.repeats)
    counts["predicted"] = estimate_integration_error(ready, settings, result, study.measure)
    errors = study.errors(ready.variant, ready.samples(result))
    return Measurement(*head, *errors, low, middle, count, **counts)  # type: ignore[arg-type]
