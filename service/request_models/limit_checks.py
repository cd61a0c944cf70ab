"""Checks of a batch against the limits of a server."""

from __future__ import annotations

import numpy as np

from trunnion.basics.problems import Problem
from trunnion.batch.plan import Plan, Run
from trunnion.scene.data_classes.scene import Scene
from trunnion.service.basics.server_settings import Limits

END, SPACING = "simulation.until", "simulation.every"


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
    problems = [
        Problem(
            n,
            f"{asked:g} is more than the {most:g} allowed to a case",
            "request a smaller number, or ask the operator for a higher limit",
        )
        for n, asked, most in (
            ("cpu_limit", run.cpu_limit or 0.0, limits.cpu_limit),
            ("max_steps", run.max_steps or 0.0, limits.max_steps),
        )
        if asked > most
    ]
    if until > limits.duration:
        problems.append(
            Problem(
                "until",
                f"{until:g} s is longer than the {limits.duration:g} s allowed",
                "request a shorter time, or ask the operator for a higher limit",
            )
        )
    if every > 0.0 and until / every > limits.rows:
        problems.append(
            Problem("every", f"{until / every:.3g} rows a case are more than the {limits.rows} allowed", "a larger spacing")
        )
    return problems


def varied_limit_problems(made: Plan, limits: Limits) -> list[Problem]:
    """Problems for violated limits when end times or spacings are varied."""
    paths, run = made.cases.paths, made.run
    if not {END, SPACING} & set(paths):
        return []
    values = made.cases.values(0, made.cases.count)
    until, every, _ = run.of(made.scene)
    ends = values[:, paths.index(END)] if END in paths and run.until is None else np.array([until])
    spacings = values[:, paths.index(SPACING)] if SPACING in paths and run.every is None else np.array([every])
    problems = []
    if (ends > limits.duration).any():
        what = f"{ends.max():g} s is longer than the {limits.duration:g} s allowed"
        problems.append(Problem(END, what, "request a shorter time, or ask the operator for a higher limit"))
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = np.where(spacings > 0.0, ends / spacings, 0.0)
    if (rows > limits.rows).any():
        what = f"{rows.max():.3g} rows a case are more than the {limits.rows} allowed"
        problems.append(Problem(SPACING, what, "a larger spacing"))
    return problems
