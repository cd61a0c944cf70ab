"""Commands whose next cases follow from the last: ``optimise`` and ``refine``. Their work is imported when they are invoked."""

from __future__ import annotations

from typing import Annotated

import typer

from engine.cli import helping, questions
from engine.cli.app import CHANGES, JSON, OPEN, SCENE, TABLE, VERBOSE
from engine.cli.helping import Listed
from engine.cli.options import words_of
from engine.cli.questions import PICTURE
from engine.cli.settings import Words, with_settings

app = questions.app
VARY = typer.Option(metavar="PATH=LOW:HIGH", help="A number and its bounds (repeatable).", autocompletion=helping.assignments)
WITHIN = typer.Option(metavar="KIND:WHAT=LOW:HIGH", help="What the best shall keep; one end may be left out (repeatable).")
KEEP = typer.Option(metavar="KIND:WHAT", help="What is kept of each case besides (repeatable).")
WORKERS = typer.Option(metavar="N", help="Threads (default: one a core).")
NEAR = typer.Option(metavar="T", help="How near to the best numbers, of their ranges.")
NARROW = typer.Option(metavar="T", help="How narrow the place of a change, of the ranges.")


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion sweep")
def optimise(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    vary: Annotated[list[str] | None, VARY] = None,
    minimise: Annotated[str | None, typer.Option(metavar="KIND:WHAT", help="The result that shall be small.")] = None,
    maximise: Annotated[str | None, typer.Option(metavar="KIND:WHAT", help="The result that shall be large.")] = None,
    reach: Annotated[str | None, typer.Option(metavar="KIND:WHAT=VALUE", help="The result that shall have a value.")] = None,
    within: Annotated[list[str] | None, WITHIN] = None,
    cases: Annotated[int, typer.Option(metavar="N", help="Most cases.")] = 600,
    seed: Annotated[int, typer.Option(metavar="S", help="The same seed gives the same cases.")] = 0,
    tolerance: Annotated[float, NEAR] = 1e-3,
    reduce: Annotated[list[str] | None, KEEP] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    save: Annotated[str | None, TABLE] = None,
    plot: Annotated[str | None, PICTURE] = None,
    workers: Annotated[int | None, WORKERS] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """The best numbers of a scene, within bounds and constraints."""
    from engine.cli.studying import StudyWish, study_command

    goals = {"minimise": minimise, "maximise": maximise, "reach": reach}
    wish = StudyWish(
        "optimise", words_of(scene, ctx), settings, vary or (), goals, within or (), "", cases, seed, tolerance, reduce or (),
        changes or (), save, plot, workers, as_json, verbose,
    )  # fmt: skip
    raise typer.Exit(study_command(wish))


@app.command(cls=Listed, context_settings=OPEN)
@with_settings("trunnion sweep")
def refine(
    ctx: typer.Context,
    settings: Words,
    scene: Annotated[str | None, SCENE] = None,
    vary: Annotated[list[str] | None, VARY] = None,
    of: Annotated[str, typer.Option(metavar="KIND:WHAT", help="The result looked at beside the outcomes.")] = "outcome",
    cases: Annotated[int, typer.Option(metavar="N", help="Most cases.")] = 200,
    tolerance: Annotated[float, NARROW] = 1e-3,
    reduce: Annotated[list[str] | None, KEEP] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    save: Annotated[str | None, TABLE] = None,
    plot: Annotated[str | None, PICTURE] = None,
    workers: Annotated[int | None, WORKERS] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Where outcomes change and a result jumps or bends: cases are added there."""
    from engine.cli.studying import StudyWish, study_command

    wish = StudyWish(
        "refine", words_of(scene, ctx), settings, vary or (), {}, (), of, cases, 0, tolerance, reduce or (), changes or (), save,
        plot, workers, as_json, verbose,
    )  # fmt: skip
    raise typer.Exit(study_command(wish))
