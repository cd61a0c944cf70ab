"""What of a batch exceeds what a server allows."""

from __future__ import annotations

import numpy as np

from engine.basics.problems import Problem
from engine.batch.plan import Plan, Run
from engine.scene.model import Scene
from service.settings import Limits

END, SPACING = "simulation.until", "simulation.every"


def too_dear(budget: float | None, limits: Limits) -> list[Problem]:
    """What of a job's budget exceeds what this server allows."""
    if budget is None or budget <= limits.job_seconds:
        return []
    return [Problem("budget", f"{budget:g} s is more than the {limits.job_seconds:g} s allowed", "a smaller budget")]


def too_many_rows(made: Plan, limits: Limits) -> list[Problem]:
    """What of the rows that are to be kept exceeds what this server allows."""
    if made.series is None:
        return []
    until, every, _ = made.run.of(made.scene)
    spacing = made.series.every or every
    size = made.cases.count * (2 + len(made.series.columns)) * 8 * (until / spacing + 2 if spacing > 0.0 else limits.rows)
    if size <= limits.output_bytes:
        return []
    what = f"{size:.3g} bytes of rows are more than the {limits.output_bytes:.3g} allowed"
    return [Problem("trajectories", what, "fewer columns, or a larger spacing")]


def too_long(run: Run, scene: Scene, limits: Limits) -> list[Problem]:
    """What of a case's time and rows exceeds what this server allows."""
    until, every, _ = run.of(scene)
    problems = [
        Problem(n, f"{asked:g} is more than the {most:g} allowed to a case", "a smaller number, or ask for a higher limit")
        for n, asked, most in (("patience", run.patience or 0.0, limits.patience), ("steps", run.steps or 0.0, limits.steps))
        if asked > most
    ]
    if until > limits.duration:
        problems.append(
            Problem("until", f"{until:g} s is longer than the {limits.duration:g} s allowed", "a shorter time, or a higher limit")
        )
    if every > 0.0 and until / every > limits.rows:
        problems.append(
            Problem("every", f"{until / every:.3g} rows a case are more than the {limits.rows} allowed", "a larger spacing")
        )
    return problems


def too_long_varied(made: Plan, limits: Limits) -> list[Problem]:
    """The same of the cases that set their own time and rows."""
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
        problems.append(Problem(END, what, "a shorter time, or a higher limit"))
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = np.where(spacings > 0.0, ends / spacings, 0.0)
    if (rows > limits.rows).any():
        what = f"{rows.max():.3g} rows a case are more than the {limits.rows} allowed"
        problems.append(Problem(SPACING, what, "a larger spacing"))
    return problems
