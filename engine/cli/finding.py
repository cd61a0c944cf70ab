"""``fit``: what measured curves say of a scene's numbers. Its work is imported when it is invoked."""

from __future__ import annotations

from typing import Annotated

import typer

from engine.cli import helping, studies
from engine.cli.app import CHANGES, JSON, OPEN, SCENE, VERBOSE
from engine.cli.helping import Listed
from engine.cli.options import words_of
from engine.cli.questions import PICTURE

app = studies.app
TO = typer.Option(
    "--to", metavar="PATH[=PRIOR]", autocompletion=helping.parameters,
    help="A number to find (repeatable); =low:high bounds it, =normal(mean, deviation) or =lognormal(…) is a prior.",
)  # fmt: skip
OWN = typer.Option(
    metavar="PATH[=PRIOR]", autocompletion=helping.parameters,
    help="The same, of which each run has a value of its own (repeatable).",
)  # fmt: skip
DATA = typer.Option(
    metavar="FILE[; PATH=VALUE]…", help="A measured run: .csv or .parquet, columns time and others; what was different in it."
)
COLUMN = typer.Option(metavar="COLUMN=NAME", help="Which of the scene's columns one of the files is, where it is named otherwise.")
NOISE = typer.Option(metavar="[COLUMN=]S", help="Standard deviation of the noise, of all or of a column (default: estimated).")
COMPARE = typer.Option(
    metavar="LAW[; PATH~GUESS]…", help="A law to compare (repeatable); PATH~GUESS is fitted with it, PATH=VALUE held."
)
TRY = typer.Option("--try", metavar="PATH=VALUE[; …]", help="An experiment that could be made (repeatable); until=T, every=DT too.")


@app.command(cls=Listed, context_settings=OPEN)
def fit(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    data: Annotated[list[str] | None, DATA] = None,
    to: Annotated[list[str] | None, TO] = None,
    own: Annotated[list[str] | None, OWN] = None,
    column: Annotated[list[str] | None, COLUMN] = None,
    noise: Annotated[list[str] | None, NOISE] = None,
    level: Annotated[str, typer.Option(metavar="P", help="Level of the intervals.")] = "0.95",
    compare: Annotated[list[str] | None, COMPARE] = None,
    trials: Annotated[list[str] | None, TRY] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    plot: Annotated[str | None, PICTURE] = None,
    as_json: Annotated[bool, JSON] = False,
    verbose: Annotated[bool, VERBOSE] = False,
) -> None:
    """Numbers from measured curves: with intervals, laws compared, the next experiment."""
    from engine.cli.fitting import FitWish, fit_command

    wish = FitWish(
        words_of(scene, ctx), data or (), to or (), own or (), column or (), noise or (), level, compare or (), trials or (),
        changes or (), plot, as_json, verbose,
    )  # fmt: skip
    raise typer.Exit(fit_command(wish))
