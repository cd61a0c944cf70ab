"""Measures every installed reference solver with a friction law that the solver can handle."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel, has_v_eps, time_repeats
from trunnion.analysis.work_precision.measurement_points import FrictionVariant, Measurement
from trunnion.analysis.work_precision.reference_solvers.exudyn import Exudyn
from trunnion.analysis.work_precision.reference_solvers.mujoco import Mujoco
from trunnion.analysis.work_precision.reference_solvers.pinocchio import Pinocchio
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import take_snapshot
from trunnion.analysis.work_precision.reference_solvers.scipy import ScipyOnClosedForm, ScipyOnEngine
from trunnion.analysis.work_precision.reference_solvers.solver_interface import (
    ReferenceSolver,
    SceneNotSupported,
    Setting,
    compares_only_positions,
)
from trunnion.analysis.work_precision.reference_solvers.sundials import Sundials

if TYPE_CHECKING:
    from trunnion.analysis.work_precision.request_and_results import Progress, WorkPrecision

SOLVERS: tuple[type[ReferenceSolver], ...] = (ScipyOnEngine, ScipyOnClosedForm, Sundials, Mujoco, Pinocchio, Exudyn)
SLOW_RUN = 5.0
"""After a run longer than this, s, the method is not tried with finer steps or tighter tolerances."""


def measure_reference_solvers(study: WorkPrecision, ready: dict[FrictionVariant, BenchmarkModel], progress: Progress) -> None:
    """Measure the installed solvers. Their points, and descriptions of what they omit, are added to the study."""
    chosen = choose_smooth_law(ready)
    if chosen is None:
        study.solvers.append(("all", "", "no law of this chart can be written as an ordinary differential equation"))
        return
    scene = take_snapshot(chosen)
    for k, kind in enumerate(SOLVERS):
        progress(kind.name, k, len(SOLVERS))
        if not kind.version():
            study.solvers.append((kind.name, "", f"not installed (pip install {kind.package})"))
            continue
        try:
            if not kind.all_columns and not compares_only_positions(chosen, scene):
                raise SceneNotSupported("only positions of mass centres can be compared with it")
            solver = kind(chosen, scene)
        except Exception as e:  # noqa: BLE001  # any exception of another program counts as its result
            why = " ".join(str(e).split()) if isinstance(e, SceneNotSupported) else _describe_exception(e)
            study.solvers.append((kind.name, kind.version(), f"not run: {why}"))
            continue
        study.solvers.append((kind.name, kind.version(), solver.describe_omissions()))
        study.points += _measure_settings(study, solver, chosen)


def choose_smooth_law(ready: dict[FrictionVariant, BenchmarkModel]) -> BenchmarkModel | None:
    """The model to solve with other programs: without friction, or with the regularised law whose v_eps is nearest to 1e-4 m/s."""
    able = [p for v, p in ready.items() if not v.law or has_v_eps(p.scene)]
    if not able:
        return None
    return min(able, key=lambda p: abs(math.log(p.variant.v_eps / 1e-4)) if p.variant.v_eps else 0.0)


def _measure_settings(study: WorkPrecision, solver: ReferenceSolver, ready: BenchmarkModel) -> list[Measurement]:
    """Points of all settings of a solver. After a run longer than SLOW_RUN the method is not refined further."""
    out: list[Measurement] = []
    slow: set[str] = set()
    omitted, no_error = solver.describe_omissions(), (math.nan, math.nan)
    for s in solver.settings():
        if s.method in slow:
            continue
        head = (solver.name, s.method, s.rtol, s.step, ready.variant.law, ready.variant.v_eps)
        started = time.perf_counter()
        try:
            data, first = solver.run(s)
        except Exception as e:  # noqa: BLE001  # any exception of another program counts as its result
            outcome = _describe_exception(e)
            out.append(Measurement(*head, *no_error, math.nan, math.nan, 0, outcome=outcome, leaves_out=omitted))
            slow |= {s.method} if time.perf_counter() - started > SLOW_RUN else set()
            continue
        if first > SLOW_RUN:
            slow.add(s.method)
        if not math.isfinite(float(abs(data).max())):
            out.append(Measurement(*head, *no_error, first, first, 1, outcome="not finite", leaves_out=omitted))
            continue
        low, middle, count = _time_runs(solver, s, first, study.request.repeats)
        out.append(Measurement(*head, *study.errors(ready.variant, data), low, middle, count, leaves_out=omitted))
    return out


def _time_runs(solver: ReferenceSolver, s: Setting, first: float, repeats: int) -> tuple[float, float, int]:
    """(minimum, median, count) of the times of repeated runs, s. If the first run takes more than 1 s, no run is repeated."""
    if first > 1.0:
        return first, first, 1
    return time_repeats(lambda: solver.run(s)[1], repeats)


def _describe_exception(e: Exception) -> str:
    return f"{type(e).__name__}: {str(e).strip().splitlines()[0][:120] if str(e).strip() else ''}"
