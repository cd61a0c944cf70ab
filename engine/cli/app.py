"""The commands and their options. Each command's work is in a module of its own, imported when it is invoked."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from engine.cli import helping
from engine.cli.extensions import Commands
from engine.cli.helping import Listed
from engine.cli.options import words_of
from engine.cli.settings import Words, with_settings

app = typer.Typer(
    name="trunnion",
    cls=Commands,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    invoke_without_command=True,
    help="How a mechanism moves, and what happens inside its joints: friction, contact points, normal forces.",
    epilog="Exit codes: 0 done; 1 failed, with a diagnosis; 2 wrong use. SCENE: a file or the name of a bundled model.",
    context_settings={"help_option_names": ["-h", "--help"]},
)
OPEN = {"ignore_unknown_options": True, "allow_extra_args": True}
"""Words typer does not know are handed to the command, which tells all of them together with its other problems."""
SCENE = typer.Argument(
    metavar="SCENE",
    help="A scene file, a folder with a scene.yaml, or a bundled model.",
    show_default=False,
    autocompletion=helping.scenes,
)
CHANGES = typer.Option(
    "--set", metavar="PATH=VALUE", help="Change a number of the scene (repeatable).", autocompletion=helping.assignments
)
OUTPUTS = typer.Option(
    "--outputs", metavar="PATTERN", help="Columns wanted, such as 'ball.*' (repeatable).", autocompletion=helping.outputs
)
SAMPLE = typer.Option(
    metavar="PATH=SPREAD",
    help="low:high, 'normal(mean, deviation)', 'lognormal(mean, deviation)', 'triangular(low, mode, high)' (repeatable).",
    autocompletion=helping.assignments,
)
SAMPLING = typer.Option(metavar="HOW", help="latin, random, sobol, or saltelli: Sobol indices, 2 × numbers + 2 cases a point.")
QUANTILES = typer.Option(metavar="P,…", help="Quantiles of what is kept at these probabilities, with intervals.")
ABOVE = typer.Option(metavar="KIND:WHAT=BOUND", help="How probably it is above a bound (repeatable).")
SAMPLED = typer.Option(metavar="FILE", help="Draw a sample's indices, or how it is spread: .png, .svg or .pdf.")
TRAJECTORIES = typer.Option(metavar="PATTERN", help="Columns whose rows are kept of every case (repeatable).")
SPACING = typer.Option(metavar="S", help="How far apart the rows kept are (default: all).")
ROWS = typer.Option(metavar="FILE", help="Where the rows kept go: .csv, .parquet, or a folder, a Parquet data set by case.")
TABLE = typer.Option("-o", "--output", metavar="FILE", help="Write .csv or .parquet.")
JSON = typer.Option("--json", help="Print one JSON document instead of text.")
VERBOSE = typer.Option("-v", "--verbose", help="Tell what is being done, and details of defects, on standard error.")


def _version(wanted: bool) -> None:
    if wanted:
        from engine.basics.version import version

        typer.echo(f"trunnion {version()}")
        raise typer.Exit


@app.callback()
def top(
    ctx: typer.Context,
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")] = False,
) -> None:
    """How a mechanism moves, and what happens inside its joints: friction, contact points, normal forces."""
    if ctx.invoked_subcommand is None:
        typer.echo(ctx.get_help())


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion simulate")
def simulate(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    outputs: Annotated[list[str] | None, OUTPUTS] = None,
    save: Annotated[str | None, TABLE] = None,
    plot: Annotated[str | None, typer.Option(metavar="FILE", help="Draw the curves: .png, .svg or .pdf.")] = None,
    animate: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write a moving picture: .html, .gif, .webp, .mp4.")
    ] = None,
    linear: Annotated[
        str | None, typer.Option("--linearize", metavar="FILE", help="Write A, B, C, D at the end of the run: .json or .npz.")
    ] = None,
    certify: Annotated[bool, typer.Option("--certify", help="State the error of every number (a second, tighter run).")] = False,
    accuracy: Annotated[
        str | None, typer.Option(metavar="A", help="Largest error: 1e-6 (positions, angles), '1 mN' (columns in N); chooses rtol.")
    ] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Run a scene: curves, tables, moving pictures."""
    from engine.cli.simulating import Wish, simulate_command

    words = words_of(scene, ctx)
    wish = Wish(words, settings, changes or [], outputs, save, plot, animate, as_json, verbose, linear)
    wish = replace(wish, certify=certify, accuracy=accuracy)
    raise typer.Exit(simulate_command(wish))


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion sweep")
def sweep(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATH=VALUES",
            help="Values of a number: first:last:count, or a,b,c (repeatable: every combination).",
            autocompletion=helping.assignments,
        ),
    ] = None,
    sample: Annotated[list[str] | None, SAMPLE] = None,
    count: Annotated[int, typer.Option(metavar="N", help="How many cases to sample; with saltelli: points.")] = 0,
    seed: Annotated[int, typer.Option(metavar="S", help="Seed of the sample.")] = 0,
    sampling: Annotated[str, SAMPLING] = "latin",
    quantiles: Annotated[list[str] | None, QUANTILES] = None,
    above: Annotated[list[str] | None, ABOVE] = None,
    reduce: Annotated[
        list[str] | None,
        typer.Option(metavar="KIND:WHAT", help="max, min, mean, final of a column pattern; first, count of an event (repeatable)."),
    ] = None,
    trajectories: Annotated[list[str] | None, TRAJECTORIES] = None,
    spacing: Annotated[str | None, SPACING] = None,
    rows: Annotated[str | None, ROWS] = None,
    certify: Annotated[bool, typer.Option("--certify", help="Keep the error of each result too (runs each case twice).")] = False,
    changes: Annotated[list[str] | None, CHANGES] = None,
    save: Annotated[str | None, TABLE] = None,
    plot: Annotated[str | None, SAMPLED] = None,
    workers: Annotated[int | None, typer.Option(metavar="N", help="Threads (default: one a core).")] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Run a scene over many values of its numbers: one row a case."""
    from engine.cli.keeping import Kept
    from engine.cli.sweeping import SweepWish, sweep_command

    words, kept = words_of(scene, ctx), Kept(trajectories or (), spacing, rows, certify)
    wish = SweepWish(
        words, settings, over or (), sample or (), count, seed, sampling, reduce or (), changes or (), save, plot,
        quantiles or (), above or (), workers, as_json, verbose, kept,
    )  # fmt: skip
    raise typer.Exit(sweep_command(wish))


@app.command(cls=Listed, context_settings=OPEN)
def check(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    outputs: Annotated[bool, typer.Option("--outputs", help="List every column the scene can give.")] = False,
    hold: Annotated[bool, typer.Option("--hold", help="Does it hold at its start, at rest? By what margin?")] = False,
    bounds: Annotated[bool, typer.Option("--bounds", help="With --hold: all that statics leaves open, not one answer.")] = False,
    self_stress: Annotated[
        float | None,
        typer.Option("--self-stress", metavar="N", help="With --bounds: most that misfit (times stiffness) loads a contact with."),
    ] = None,
    misfit: Annotated[
        float | None, typer.Option("--misfit", metavar="M", help="With --bounds: the same by how far, m, joints are from fitting.")
    ] = None,
    budget: Annotated[float | None, typer.Option("--budget", metavar="S", help="With --bounds: seconds for all searches.")] = None,
    plot: Annotated[str | None, typer.Option("--plot", metavar="FILE", help="Draw the assembled start: .png, .svg, .pdf.")] = None,
    whole: Annotated[
        str | None, typer.Option("-o", "--output", metavar="FILE", help="Write the scene without includes and copies: .yaml.")
    ] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Tell a scene's problems, or what it is: bodies, freedoms, loops, columns."""
    from engine.cli.check_files import Files
    from engine.cli.checking import Holding, check_command

    held = Holding(hold, bounds, self_stress, misfit, budget)
    raise typer.Exit(check_command(words_of(scene, ctx), outputs, held, Files(plot, whole), changes or [], as_json, verbose))


@app.command()
def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the scene and of its folder.")],
    folder: Annotated[str, typer.Option("--dir", metavar="DIR", help="Where to put it.")] = ".",
    as_json: Annotated[bool, JSON] = False,
) -> None:
    """Write a commented scene to start from."""
    from engine.cli.listing import new_command

    raise typer.Exit(new_command(name, folder, as_json))


@app.command()
def models(as_json: Annotated[bool, JSON] = False) -> None:
    """List the bundled models."""
    from engine.cli.listing import models_command

    raise typer.Exit(models_command(as_json))


@app.command()
def schema() -> None:
    """Print the JSON Schema of scene files."""
    from engine.cli.listing import schema_command

    raise typer.Exit(schema_command())
