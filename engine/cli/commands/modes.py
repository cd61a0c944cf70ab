"""``trunnion modes``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Plot, Scene
from trunnion.cli.output.exit_codes_and_errors import DONE
from trunnion.cli.output.printed_output import number, print_answer, table

if TYPE_CHECKING:
    from trunnion.analysis.mechanics.vibration_modes import VibrationModes

DRAWN = 12
"""Largest count of modes in a picture."""
NEGLIGIBLE = 1e-12
"""Entries below this fraction of the largest entry are round-off."""


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    stick: Annotated[
        bool, typer.Option("--stick", help="Lock the joints with friction, so that only the other joints move.")
    ] = False,
    at_start: Annotated[
        bool, typer.Option("--at-start", help="Linearise at the start pose, which must be a pose of rest.")
    ] = False,
    changes: Changes,
    plot: Plot = None,
    as_json: Json = False,
) -> int:
    """Compute vibrations about the pose of rest: frequencies, damping, mode shapes."""
    from trunnion.analysis.mechanics.vibration_modes import modes

    reader = ArgumentReader()
    picture = reader.picture(plot)
    loaded = reader.checked(reader.scene(scene, ctx, changes))
    result = modes(loaded, stick, at_start)
    if picture:
        draw(result, picture)
    rows = [
        (str(i), number(m.frequency, 9), number(m.damping, 4), number(m.rate), largest_parts(m.shape))
        for i, m in enumerate(result.modes, 1)
    ]
    lines = [f"{loaded.name}, about its pose of rest" + (f", {', '.join(result.held)} held by friction" if result.held else "")]
    lines += table(("mode", "Hz", "damping ratio", "rate, 1/s", "shape (largest components)"), rows)
    return print_answer(as_json, DONE, result.document(), lines, [picture])


def largest_parts(shape: dict[str, complex]) -> str:
    """The four largest entries of a mode shape, without entries that are only round-off."""
    largest = sorted(shape.items(), key=lambda p: -abs(p[1]))[:4]
    shown = [(n, x) for n, x in largest if abs(x) > NEGLIGIBLE * abs(largest[0][1])]
    return ", ".join(f"{n.removesuffix('[1]').replace('.qd', '')} {x.real:+.3g}" for n, x in shown)


def draw(result: VibrationModes, picture: Path) -> None:
    """Draw the first modes."""
    from trunnion.analysis.mechanics.vibration_modes import displaced
    from trunnion.plots.mechanism_pictures.mode_shapes import draw_mode_shapes
    from trunnion.plots.style.figure_files import save_figure

    titles = [f"{m.frequency:.4g} Hz" if m.frequency else f"{m.rate:.3g} 1/s" for m in result.modes[:DRAWN]]
    drawn = [(f"mode {i + 1}: {t}", displaced(result, i), displaced(result, i, -0.3)) for i, t in enumerate(titles)]
    save_figure(draw_mode_shapes(result.scene, drawn), picture)
