"""``trunnion inverse``."""

from __future__ import annotations

import math
from functools import partial
from typing import Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, CsvTable, Json, Outputs, Scene, repeatable
from trunnion.cli.output.exit_codes_and_errors import DONE
from trunnion.cli.output.printed_output import number, print_answer, table

MOST_MISSING = 12
"""Largest count of unsolved instants that are listed."""
MOTION = "File of the motion (.csv or .parquet), with columns time and JOINT.q[k], and if known JOINT.qd[k] and JOINT.qdd[k]."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    motion: Annotated[str | None, typer.Option("--motion", metavar="FILE", help=MOTION)] = None,
    drive: Annotated[
        list[str], repeatable("--drive", metavar="JOINT", help="Joint whose motion in the file is prescribed.", show_default="all")
    ],
    changes: Changes,
    outputs: Outputs,
    save: CsvTable = None,
    as_json: Json = False,
) -> int:
    """For a given motion with friction, compute contact points, normal forces, and the efforts of drives."""
    from trunnion.analysis.mechanics.inverse_dynamics import inverse
    from trunnion.analysis.mechanics.motion_files import read_motion
    from trunnion.cli.output.csv_table import write_csv

    reader = ArgumentReader()
    loaded = reader.scene(scene, ctx, changes)
    path = reader.destination(save, (".csv",))
    read = None
    if motion is None:
        reader.add("--motion", "no file is given", "--motion FILE, such as a table that trunnion simulate -o wrote")
    elif loaded is not None:
        read = reader.attempt(partial(read_motion, motion, loaded, tuple(drive)))
        reader.check_columns(loaded, [p for p in outputs if ".drive." not in p])
    times, columns = reader.checked(read)
    loaded = reader.checked(loaded)
    result = inverse(loaded, times, columns, outputs or None)
    if path:
        write_csv(path, result.names, result.time, result.values)
    finite = ([v for v in result[n] if v == v] or [math.nan] for n in result.names)
    rows = [(n, u, number(min(x)), number(max(x))) for n, u, x in zip(result.names, result.units, finite, strict=True)]
    lines = [f"{loaded.name}, {len(result.time)} instants", *table(("column", "unit", "least", "largest"), rows)]
    lines += [*result.missing[:MOST_MISSING], *(f"note: {n}" for n in result.notes)]
    return print_answer(as_json, DONE, result.document(), lines, [path])
