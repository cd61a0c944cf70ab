"""``trunnion simulate``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Animation, Changes, Json, Outputs, Plot, Scene, SettingWords, Table
from trunnion.cli.requests.run_request import RunRequest, destinations, names_columns, run_and_report

ACCURACY = "Choose rtol so that errors stay below this: 1e-6 (positions in m, angles in rad), or '1 mN' (columns in N)."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    certify: Annotated[
        bool, typer.Option("--certify", help="Estimate the error of every number by a second run at a tighter tolerance.")
    ] = False,
    accuracy: Annotated[str | None, typer.Option(metavar="A", help=ACCURACY)] = None,
    changes: Changes,
    outputs: Outputs,
    save: Table = None,
    plot: Plot = None,
    animate: Animation = None,
    linearize: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the matrices A, B, C, D at the end of the run: .json or .npz.")
    ] = None,
    as_json: Json = False,
) -> int:
    """Simulate the motion of a mechanism; write tables, curves and animations."""
    reader = ArgumentReader()
    arguments = settings.values(reader)
    files = destinations(reader, table=save, plot=plot, animation=animate, linearization=linearize)
    loaded = reader.scene(scene, ctx, changes, arguments.pop("law"))
    reader.check_columns(loaded, outputs)
    loaded = reader.checked(loaded)
    arguments |= {"certify": certify, "accuracy": accuracy}
    return run_and_report(RunRequest(loaded, arguments, tuple(outputs) or loaded.outputs, files, names_columns(outputs)), as_json)
