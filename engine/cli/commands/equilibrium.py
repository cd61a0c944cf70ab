"""``trunnion equilibrium``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.basics.errors import SimulationError
from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Plot, Scene, repeatable
from trunnion.cli.output.exit_codes_and_errors import DONE
from trunnion.cli.output.hold_report import hold_document, verdict
from trunnion.cli.output.printed_output import number, print_answer, table

if TYPE_CHECKING:
    from trunnion.analysis.mechanics.friction_rest_ranges import Band


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
    """Tell whether friction holds the mechanism in its given pose, and in which range around this pose. Then find stable and
    unstable poses of rest without friction, and the range around each pose in which friction holds the mechanism."""
    from trunnion.analysis.mechanics.equilibrium_pose import equilibrium, start_at
    from trunnion.analysis.static_bounds.start_pose_statics import hold

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
    lines = [f"{loaded.name}, given pose: {verdict(given)}"]
    lines += _ranges("around the given pose, friction holds each coordinate within this range:", result.around)
    if result.kind == "none":
        lines += ["", "without friction there is no pose of rest"]
    else:
        lines += ["", f"pose of rest without friction ({result.kind})", *_pose(result.q)]
        lines += _ranges("friction holds each coordinate in this range, with the other coordinates at these values:", result.bands)
    for other in result.others:
        lines += ["", f"further pose of rest without friction ({other.kind})", *_pose(other.q), *_ranges("", other.bands)]
    return print_answer(as_json, DONE, {"given": hold_document(given), **result.document()}, lines, [picture])


def _pose(q: Mapping[str, Sequence[float]]) -> list[str]:
    return table(("joint", "coordinates"), [(n, ", ".join(number(x, 9) for x in v)) for n, v in q.items()])


def _ranges(head: str, bands: Sequence[Band]) -> list[str]:
    """The lines of a table of ranges of rest, below a heading. Without ranges, there are no lines."""
    if not bands:
        return []
    first = [" / ".join(dict.fromkeys(x for x in b.first if x)) for b in bands]
    rows = [(b.coordinate, bound(b.low), bound(b.high), f) for b, f in zip(bands, first, strict=True)]
    return ["", *([head] if head else []), *table(("coordinate", "from", "to", "slips first"), rows)]


def bound(x: float | None) -> str:
    """An end of a range of rest as text."""
    return "no end" if x is None else number(x, 9)
