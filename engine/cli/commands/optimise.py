"""``trunnion optimise``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Plot, Reduce, Scene, SettingWords, Table, Workers, repeatable
from trunnion.cli.requests.study_request import MostCases, VaryWithin, run_and_report_study
from trunnion.cli.requests.varied_numbers import Seed

WITHIN = "Constraint: lower and upper bound of a result. One bound may be empty."
TOLERANCE = "The search ends when the best value of each number is known to this fraction of the number's range."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    vary: VaryWithin,
    minimise: Annotated[str | None, typer.Option(metavar="KIND:WHAT", help="Make this result as small as possible.")] = None,
    maximise: Annotated[str | None, typer.Option(metavar="KIND:WHAT", help="Make this result as large as possible.")] = None,
    reach: Annotated[
        str | None, typer.Option(metavar="KIND:WHAT=VALUE", help="Bring this result as close as possible to a value.")
    ] = None,
    within: Annotated[list[str], repeatable(metavar="KIND:WHAT=LOW:HIGH", help=WITHIN)],
    cases: MostCases = 600,
    seed: Seed = 0,
    tolerance: Annotated[float, typer.Option(metavar="T", help=TOLERANCE)] = 1e-3,
    reduce: Reduce,
    changes: Changes,
    save: Table = None,
    plot: Plot = None,
    workers: Workers = None,
    as_json: Json = False,
) -> int:
    """Find the numbers of a scene, within bounds and constraints, for which a result is best."""
    reader = ArgumentReader()
    goals: dict[str, Any] = {n: g for n, g in (("minimise", minimise), ("maximise", maximise)) if g is not None}
    if reach is not None:
        name, sign, value = (part.strip() for part in reach.rpartition("="))
        if not sign or not value:
            reader.add("--reach", f"{reach!r} is not KIND:WHAT=VALUE", "such as 'final:guide.q[1]=5 m'")
            name, value = reach, "0"
        goals["reach"] = (name, value)
    return run_and_report_study(
        "optimise", ctx, scene, settings, vary, reduce, changes, {"table": save, "plot": plot}, workers, as_json, reader,
        goals=goals, within=constraints(within, reader), cases=cases, seed=seed, tolerance=tolerance,
    )  # fmt: skip


def constraints(texts: Sequence[str], reader: ArgumentReader) -> dict[str, tuple[str | None, str | None]]:
    """{result: (low, high)} from words KIND:WHAT=LOW:HIGH. An empty end becomes None."""
    out: dict[str, tuple[str | None, str | None]] = {}
    for text in texts:
        name, _, ends = (part.strip() for part in text.rpartition("="))
        low, sign, high = (part.strip() for part in ends.partition(":"))
        if not sign or not name or not (low or high):
            reader.add("--within", f"{text!r} is not KIND:WHAT=LOW:HIGH", "one end may be empty: 'max:x=:20 kN'")
        out[name] = (low or None, high or None)
    return out
