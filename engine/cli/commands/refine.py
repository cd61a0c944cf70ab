"""``trunnion refine``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Plot, Reduce, Scene, SettingWords, Table, Workers
from trunnion.cli.requests.study_request import MostCases, VaryWithin, run_and_report_study

TOLERANCE = "The search ends when every change is located to this fraction of the numbers' ranges."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    vary: VaryWithin,
    of: Annotated[str, typer.Option(metavar="KIND:WHAT", help="The result whose jumps and kinks are located.")] = "outcome",
    cases: MostCases = 200,
    tolerance: Annotated[float, typer.Option(metavar="T", help=TOLERANCE)] = 1e-3,
    reduce: Reduce,
    changes: Changes,
    save: Table = None,
    plot: Plot = None,
    workers: Workers = None,
    as_json: Json = False,
) -> int:
    """Find the values of numbers at which the outcome changes, or a result jumps or has a kink. The search adds cases near these
    values."""
    return run_and_report_study(
        "refine", ctx, scene, settings, vary, reduce, changes, {"table": save, "plot": plot}, workers, as_json, ArgumentReader(),
        of=of, cases=cases, tolerance=tolerance,
    )  # fmt: skip
