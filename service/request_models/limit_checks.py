"""Checks of a batch against the limits of a server."""

from __future__ import annotations

import numpy as np

from trunnion.basics.problems import Problem
from trunnion.batch.plan import Plan, Run
from trunnion.scene.data_classes.scene import Scene
from trunnion.service.basics.server_settings import Limits

END, SPACING = "simulation.until", "simulation.every"
HIGHER = "ask the operator for a higher limit"


def budget_problems(budget: float | None, limits: Limits) -> list[Problem]:
    if budget is None or budget <= limits.job_seconds:
        return []
    return [Problem("budget", f"{budget:g} s is more than the {limits.job_seconds:g} s allowed", "a smaller budget")]


def kept_row_problems(made: Plan, limits: Limits) -> list[Problem]:
    if made.series is None:
        return []
    until, every, _ = made.run.of(made.scene)
    spacing = made.series.every or every
    size = made.cases.count * (2 + len(made.series.columns)) * 8 * (until / spacing + 2 if spacing > 0.0 else limits.rows)
    if size <= limits.output_bytes:
        return []
    what = f"{size:.3g} bytes of rows are more than the {limits.output_bytes:.3g} allowed"
    return [Problem("trajectories", what, "request fewer columns, or a larger spacing")]


def case_limit_problems(run: Run, scene: Scene, limits: Limits) -> list[Problem]:
    """Problems for violated limits of the time, steps and rows of a case."""
    until, every, _ = run.of(scene)
    asked = {"cpu_limit": run.cpu_limit or 0.0, "max_steps": run.max_steps or 0.0}
    problems = [
        Problem(n, f"{x:g} is more than the {getattr(limits, n):g} allowed to a case", f"request a smaller number, or {HIGHER}")
        for n, x in asked.items()
        if x > getattr(limits, n)
    ]
    rows = until / every if every > 0.0 else 0.0
    return problems + _long_run_problems("until", until, "every", rows, limits)


def varied_limit_problems(made: Plan, limits: Limits) -> list[Problem]:
    """Problems for violated limits when end times or spacings are varied."""
    paths, run = made.cases.paths, made.run
    if not {END, SPACING} & set(paths):
        return []
    values = made.cases.values(0, made.cases.count)
    until, every, _ = run.of(made.scene)
    ends = values[:, paths.index(END)] if END in paths and run.until is None else np.array([until])
    spacings = values[:, paths.index(SPACING)] if SPACING in paths and run.every is None else np.array([every])
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = np.where(spacings > 0.0, ends / spacings, 0.0)
    return _long_run_problems(END, ends.max(), SPACING, rows.max(), limits)


def _long_run_problems(end: str, until: float, spacing: str, rows: float, limits: Limits) -> list[Problem]:
    """Problems for a too long time and too many rows of a case. end, spacing: places of the two numbers in the request."""
    problems = []
    if until > limits.duration:
        what = f"{until:g} s is longer than the {limits.duration:g} s allowed"
        problems.append(Problem(end, what, f"request a shorter time, or {HIGHER}"))
    if rows > limits.rows:
        what = f"{rows:.3g} rows a case are more than the {limits.rows} allowed"
        problems.append(Problem(spacing, what, "a larger spacing"))
    return problems
