"""Commands that ask something else than motion: ``equilibrium``, ``modes``, ``inverse``, ``wear``, ``knocks``,
``kinematics``. Their work is imported when they are invoked."""

from __future__ import annotations

from typing import Annotated

import typer

from engine.cli import measuring
from engine.cli.app import CHANGES, JSON, OPEN, OUTPUTS, SCENE, TABLE, VERBOSE
from engine.cli.helping import Listed
from engine.cli.options import words_of
from engine.cli.settings import Words, with_settings

app = measuring.app
PICTURE = typer.Option("--plot", metavar="FILE", help="Draw it: .png, .svg or .pdf.")


@app.command(cls=Listed, context_settings=OPEN)
def equilibrium(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    along: Annotated[
        list[str] | None, typer.Option("--along", metavar="JOINT", help="Joint whose band of rest is wanted (else all that rub).")
    ] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    plot: Annotated[str | None, PICTURE] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Where it comes to rest, and how far from there friction holds it."""
    from engine.cli.asking import Wish, equilibrium_command

    raise typer.Exit(equilibrium_command(Wish(words_of(scene, ctx), changes or [], plot, as_json, verbose), along or []))


@app.command(cls=Listed, context_settings=OPEN)
def modes(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    stick: Annotated[bool, typer.Option("--stick", help="With the joints that rub held: what friction lets swing.")] = False,
    at_start: Annotated[bool, typer.Option("--at-start", help="About the start, which must be a pose of rest.")] = False,
    changes: Annotated[list[str] | None, CHANGES] = None,
    plot: Annotated[str | None, PICTURE] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """How it swings about its rest: frequencies, damping, shapes."""
    from engine.cli.asking import Wish, modes_command

    raise typer.Exit(modes_command(Wish(words_of(scene, ctx), changes or [], plot, as_json, verbose), stick, at_start))


@app.command(cls=Listed, context_settings=OPEN)
def inverse(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    motion: Annotated[
        str | None,
        typer.Option("--motion", metavar="FILE", help="Columns time, JOINT.q[k] (and .qd[k], .qdd[k]): .csv or .parquet."),
    ] = None,
    drive: Annotated[
        list[str] | None, typer.Option("--drive", metavar="JOINT", help="Joints of the file that are prescribed (default: all).")
    ] = None,
    outputs: Annotated[list[str] | None, OUTPUTS] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    save: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write .csv.")] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """What a given motion takes: efforts with friction, contacts, normal forces."""
    from engine.cli.asking import InverseWish, Wish, inverse_command

    wish = Wish(words_of(scene, ctx), changes or [], None, as_json, verbose)
    raise typer.Exit(inverse_command(wish, InverseWish(motion, drive or [], outputs, save)))


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion wear")
def wear(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    coefficient: Annotated[
        str | None, typer.Option("-k", metavar="K", help="Wear coefficient: '1e-6 mm^3/(N*m)' (else the scene's).")
    ] = None,
    depth: Annotated[str | None, typer.Option("--depth", metavar="D", help="Depth to which runs are counted: '10 um'.")] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    save: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write .csv.")] = None,
    plot: Annotated[str | None, PICTURE] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """What a run wears off its contacts: sliding distance, pV, volume, depth around the pin, runs to a depth."""
    from engine.cli.wearing import WearWish, wear_command

    wish = WearWish(words_of(scene, ctx), settings, coefficient, depth, changes or [], save, plot, as_json, verbose)
    raise typer.Exit(wear_command(wish))


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion knocks")
def knocks(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    clearance: Annotated[
        list[str] | None,
        typer.Option("--clearance", metavar="C", help="Radial clearance: '20 um' of all hinges and balls, or JOINT='20 um'."),
    ] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Where pins with clearance would cross their bearings, for how long, how fast they would hit."""
    from engine.cli.knocking import KnocksWish, knocks_command

    wish = KnocksWish(words_of(scene, ctx), settings, clearance or [], changes or [], as_json, verbose)
    raise typer.Exit(knocks_command(wish))


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion kinematics")
def kinematics(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    outputs: Annotated[list[str] | None, OUTPUTS] = None,
    save: Annotated[str | None, TABLE] = None,
    plot: Annotated[str | None, PICTURE] = None,
    animate: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write a moving picture: .html, .gif, .webp, .mp4.")
    ] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Where drives take a mechanism, how fast and how suddenly; bodies need no masses."""
    from engine.cli.simulating import Wish, simulate_command

    words = words_of(scene, ctx)
    wish = Wish(words, settings, changes or [], outputs, save, plot, animate, as_json, verbose, kinematic=True)
    raise typer.Exit(simulate_command(wish))
