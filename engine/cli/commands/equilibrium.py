"""``trunnion equilibrium``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.basics.problems import SimulationError
from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Plot, Scene, repeatable
from trunnion.cli.output.exit_codes import DONE
from trunnion.cli.output.hold_report import hold_document, verdict
from trunnion.cli.output.printed_output import number, print_answer, table


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    along: Annotated[
        list[str],
        repeatable(
            "--along", metavar="JOINT", help="Joint whose range of rest is computed.", show_default="all with friction"
        ),
    ],
    changes: Changes,
    plot: Plot = None,
    as_json: Json = False,
) -> int:
    """Tell whether friction holds the given pose. Then find the pose of rest without friction, and the range around it in which
    friction holds the mechanism."""
    from trunnion.analysis.mechanics.equilibrium_pose import equilibrium, start_at
    from trunnion.analysis.static_bounds.static_margin import hold

    reader = ArgumentReader()
    picture = reader.picture(plot)
    loaded = reader.checked(reader.scene(scene, ctx, changes))
    given = hold(loaded)
    try:
        result = equilibrium(loaded, tuple(along) or None)
    except SimulationError as e:
        raise SimulationError(f"{e}; given pose: {verdict(given)}") from e
    if picture:
        from trunnion.plots.mechanism_pictures.instant_picture import mechanism
        from trunnion.plots.style.figure_files import save_figure

        save_figure(mechanism(start_at(loaded, result.q)), picture)
    rows = [(n, ", ".join(number(x, 9) for x in v)) for n, v in result.q.items()]
    start = [f"{loaded.name}, given pose: {verdict(given)}", ""]
    lines = [*start, f"pose of rest without friction ({result.kind})", *table(("joint", "coordinates"), rows)]
    if result.bands:
        first = [" / ".join(dict.fromkeys(x for x in b.first if x)) for b in result.bands]
        bands = [(b.coordinate, bound(b.low), bound(b.high), f) for b, f in zip(result.bands, first, strict=True)]
        head = ("coordinate", "from", "to", "slips first")
        lines += ["", "friction holds each coordinate within this range, with the other coordinates as above:", *table(head, bands)]
    return print_answer(as_json, DONE, {"given": hold_document(given), **result.document()}, lines, [picture])


def bound(x: float | None) -> str:
    """An end of a range of rest as text."""
    return "no end" if x is None else number(x, 9)
