"""Commands that measure (``chart``, ``sensitivity``, ``advise``) and ``import``. Their work is imported when they are invoked."""

from __future__ import annotations

from typing import Annotated

import typer

from engine.cli import helping
from engine.cli.app import CHANGES, JSON, OPEN, SCENE, VERBOSE, app
from engine.cli.helping import Listed
from engine.cli.options import words_of
from engine.cli.settings import Words, with_settings

FOLDER = typer.Option("-o", "--output", metavar="DIR", help="Folder to write to.", show_default=False)
OLD_FILE = typer.Option("--file", hidden=True)
OLD_FOLDER = typer.Option("--output-dir", hidden=True)
"""Names that -o had in some commands; they go on working."""


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion chart")
def chart(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    folder: Annotated[str | None, FOLDER] = None,
    old_folder: Annotated[str | None, OLD_FOLDER] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    v_eps: Annotated[list[str] | None, typer.Option("--v-eps", metavar="V", help="Values of v_eps (repeatable).")] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            "--outputs", metavar="NAME", help="Columns compared (default: positions of all bodies).", autocompletion=helping.outputs
        ),
    ] = None,
    norm: Annotated[str | None, typer.Option(metavar="N", help="max, or rms for columns that jump.")] = None,
    repeat: Annotated[int, typer.Option(metavar="N", help="Repeats of each run.")] = 7,
    samples: Annotated[int, typer.Option(metavar="N", help="Times at which runs are compared.")] = 100,
    fixed: Annotated[bool, typer.Option("--fixed/--no-fixed", help="With fixed steps too.")] = True,
    peers: Annotated[bool, typer.Option("--peers/--no-peers", help="With other programs that are installed.")] = True,
    scaling: Annotated[bool, typer.Option("--scaling", help="Cost against bodies, friction joints, loops, cases.")] = False,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Chart accuracy against cost: every method, tolerance, step and friction law."""
    from engine.cli.charting import ChartWish, chart_command

    wish = ChartWish(words_of(scene, ctx), settings, folder or old_folder, changes or [], v_eps or [],
                     outputs or [], norm, repeat, samples, fixed, peers, scaling, as_json, verbose)  # fmt: skip
    raise typer.Exit(chart_command(wish))


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion sensitivity")
def sensitivity(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    to: Annotated[
        list[str] | None,
        typer.Option("--to", metavar="PATH", help="Parameter (repeatable), as for --set.", autocompletion=helping.parameters),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            "--outputs",
            metavar="NAME",
            help="Columns to differentiate, such as 'ball.*' (repeatable).",
            autocompletion=helping.outputs,
        ),
    ] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    save: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write .csv.")] = None,
    old_file: Annotated[str | None, OLD_FILE] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Derivatives of outputs by parameters through a run, exact across its events."""
    from engine.cli.sensing import SensitivityWish, sensitivity_command

    words = words_of(scene, ctx)
    wish = SensitivityWish(words, settings, to or [], outputs or [], changes or [], save or old_file, as_json, verbose)
    raise typer.Exit(sensitivity_command(wish))


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion advise")
def advise(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    error: Annotated[str | None, typer.Option(metavar="E", help="Relative error the outputs may have: 1e-3.")] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option("--outputs", metavar="NAME", help="Columns that must be right (repeatable).", autocompletion=helping.outputs),
    ] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    norm: Annotated[str | None, typer.Option(metavar="N", help="rms, or max.")] = None,
    repeat: Annotated[int, typer.Option(metavar="N", help="Repeats of each timed run.")] = 7,
    save: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write the reduced scene: .yaml.")] = None,
    old_file: Annotated[str | None, OLD_FILE] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """The least model, method and tolerance that are good enough, with the evidence."""
    from engine.cli.advising import AdviseWish, advise_command

    wish = AdviseWish(
        words_of(scene, ctx), settings, error, outputs or [], changes or [], norm, repeat, save or old_file, as_json, verbose
    )
    raise typer.Exit(advise_command(wish))


@app.command(name="import")
def import_(
    file: Annotated[str, typer.Argument(metavar="FILE", help="A mechanism (URDF, MJCF, SDF, ASMT) or a mesh (STL, OBJ, PLY).")],
    save: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write .yaml instead of printing.")] = None,
    old_file: Annotated[str | None, OLD_FILE] = None,
    density: Annotated[str, typer.Option(metavar="D", help="Density of a mesh's solid.")] = "7800 kg/m^3",
    unit: Annotated[str, typer.Option(metavar="U", help="Unit of lengths in a mesh or ASMT: m, cm, mm, in.")] = "mm",
    stops: Annotated[str | None, typer.Option(metavar="K", help="Stiffness of limits, N/m or N*m/rad (else left out).")] = None,
    as_json: Annotated[bool, JSON] = False,
) -> None:
    """Take over another program's mechanism as a scene, or a mesh as a body with its mass properties."""
    from engine.cli.importing import import_command

    raise typer.Exit(import_command(file, save or old_file, density, unit, stops, as_json))
