"""Commands that measure (``chart``, ``sensitivity``, ``advise``) and ``import``. Their work is imported when they are invoked."""

from __future__ import annotations

from typing import Annotated

import typer

from engine.cli.app import JSON, OPEN, SCENE, VERBOSE, _words, app

CHANGES = typer.Option("--set", metavar="PATH=VALUE", help="Change a number of the scene (repeatable).")
FOLDER = typer.Option("-o", "--output-dir", metavar="DIR", help="Where to write.", show_default=False)


@app.command(context_settings=OPEN)
def chart(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    folder: Annotated[str | None, FOLDER] = None,
    until: Annotated[str | None, typer.Option(metavar="T", help="End time (default: the scene's).")] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    law: Annotated[list[str] | None, typer.Option(metavar="L", help="Friction laws (repeatable; default: all).")] = None,
    v_eps: Annotated[list[str] | None, typer.Option("--v-eps", metavar="V", help="Values of v_eps (repeatable).")] = None,
    method: Annotated[list[str] | None, typer.Option(metavar="M", help="Methods (repeatable; default: all).")] = None,
    rtol: Annotated[list[str] | None, typer.Option(metavar="R", help="Tolerances (repeatable; default 1e-2 … 1e-12).")] = None,
    output: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Columns compared (default: positions of all bodies).")
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

    wish = ChartWish(_words(scene, ctx), folder, until, changes or [], law or [], v_eps or [], method or [], rtol or [],
                     output or [], norm, repeat, samples, fixed, peers, scaling, as_json, verbose)  # fmt: skip
    raise typer.Exit(chart_command(wish))


@app.command(context_settings=OPEN)
def sensitivity(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    to: Annotated[list[str] | None, typer.Option("--to", metavar="PATH", help="Parameter (repeatable), as for --set.")] = None,
    output: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Output, such as 'ball.*' (repeatable).")] = None,
    until: Annotated[str | None, typer.Option(metavar="T", help="End time (default: the scene's).")] = None,
    every: Annotated[str | None, typer.Option(metavar="DT", help="Spacing of the rows (default: a hundredth).")] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    law: Annotated[str | None, typer.Option(metavar="L", help="Friction law of all joints.")] = None,
    rtol: Annotated[str | None, typer.Option(metavar="R", help="Tolerance of the run underneath (default 1e-9).")] = None,
    save: Annotated[str | None, typer.Option("-o", "--file", metavar="FILE", help="Write .csv.")] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Derivatives of outputs by parameters through a run, exact across its events."""
    from engine.cli.sensing import SensitivityWish, sensitivity_command

    words = _words(scene, ctx)
    wish = SensitivityWish(words, to or [], output or [], until, every, changes or [], law, rtol, save, as_json, verbose)
    raise typer.Exit(sensitivity_command(wish))


@app.command(context_settings=OPEN)
def advise(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    error: Annotated[str | None, typer.Option(metavar="E", help="Relative error the outputs may have: 1e-3.")] = None,
    output: Annotated[list[str] | None, typer.Option(metavar="NAME", help="What must be right (repeatable).")] = None,
    until: Annotated[str | None, typer.Option(metavar="T", help="End time (default: the scene's).")] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    norm: Annotated[str | None, typer.Option(metavar="N", help="rms, or max.")] = None,
    repeat: Annotated[int, typer.Option(metavar="N", help="Repeats of each timed run.")] = 7,
    save: Annotated[str | None, typer.Option("-o", "--file", metavar="FILE", help="Write the reduced scene: .yaml.")] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """The least model, method and tolerance that are good enough, with the evidence."""
    from engine.cli.advising import AdviseWish, advise_command

    wish = AdviseWish(_words(scene, ctx), error, output or [], until, changes or [], norm, repeat, save, as_json, verbose)
    raise typer.Exit(advise_command(wish))


@app.command(name="import")
def import_(
    file: Annotated[str, typer.Argument(metavar="FILE", help="A URDF (a whole scene) or a closed mesh: STL, OBJ, PLY (a body).")],
    save: Annotated[str | None, typer.Option("-o", "--file", metavar="FILE", help="Write .yaml instead of printing.")] = None,
    density: Annotated[str, typer.Option(metavar="D", help="Density of a mesh's solid.")] = "7800 kg/m^3",
    unit: Annotated[str, typer.Option(metavar="U", help="Unit of a mesh's numbers: m, cm, mm, in.")] = "mm",
    as_json: Annotated[bool, JSON] = False,
) -> None:
    """Take over a URDF as a scene, or a mesh as a body with its mass properties."""
    from engine.cli.importing import import_command

    raise typer.Exit(import_command(file, save, density, unit, as_json))
