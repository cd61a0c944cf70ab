"""``trunnion kinematics``."""

from __future__ import annotations

from dataclasses import replace

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Animation, Changes, Json, Outputs, Plot, Scene, SettingWords, Table
from trunnion.cli.requests.run_request import RunRequest, destinations, names_columns, run_and_report


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    changes: Changes,
    outputs: Outputs,
    save: Table = None,
    plot: Plot = None,
    animate: Animation = None,
    as_json: Json = False,
) -> int:
    """Compute the positions, velocities and accelerations that drives prescribe; bodies need no masses."""
    from trunnion.analysis.mechanics.kinematics import moving_columns, prescribed

    reader = ArgumentReader()
    arguments = settings.values(reader)
    files = destinations(reader, table=save, plot=plot, animation=animate)
    loaded = reader.scene(scene, ctx, changes, massless=True)
    bare = reader.attempt(lambda: prescribed(loaded)) if loaded is not None else None
    reader.check_columns(bare, outputs)
    bare = reader.checked(bare)
    patterns = moving_columns(bare)
    moving = replace(bare, outputs=patterns)
    return run_and_report(RunRequest(moving, arguments, tuple(outputs) or patterns, files, names_columns(outputs)), as_json)
