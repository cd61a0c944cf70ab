"""``trunnion wear``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, CsvTable, Json, Plot, Scene, SettingWords
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED
from trunnion.cli.output.printed_output import number, print_answer, table

if TYPE_CHECKING:
    from trunnion.analysis.mechanics.wear import Wear

COLUMNS = ("contact", "slides, m", "load, J", "worn off, mm³", "deepest, µm", "largest pV, MPa m/s", "energy, J/mm²")
COEFFICIENT = "Wear coefficient, m^2/N, such as '1e-6 mm^3/(N*m)'."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    coefficient: Annotated[str | None, typer.Option("-k", metavar="K", help=COEFFICIENT, show_default="the scene's")] = None,
    depth: Annotated[
        str | None,
        typer.Option("--depth", metavar="D", help="Also compute how many such runs cause wear of this depth, such as '10 um'."),
    ] = None,
    changes: Changes,
    save: CsvTable = None,
    plot: Plot = None,
    as_json: Json = False,
) -> int:
    """Compute the wear of contacts in a run: sliding distance, pV (pressure times speed), volume, and depth around the pin."""
    import numpy as np

    from trunnion.analysis.mechanics.wear import wear
    from trunnion.cli.output.csv_table import write_csv
    from trunnion.simulation.run import simulate

    reader = ArgumentReader()
    chosen = settings.values(reader)
    path = reader.destination(save, (".csv",))
    picture = reader.picture(plot)
    k = None if coefficient is None else reader.quantity(coefficient, "m^2/N", "-k")
    deep = None if depth is None else reader.quantity(depth, "m", "--depth")
    loaded = reader.checked(reader.scene(scene, ctx, changes, chosen.pop("law")))
    result = simulate(loaded, outputs=("*",), **chosen)
    worn = wear(result, k)
    if path is not None:
        write_csv(path, list(worn.columns), worn.time, np.array([*worn.columns.values()]).reshape(-1, len(worn.time)).T)
    contacts = [c.document() | ({"runs": c.cycles(deep)} if deep is not None else {}) for c in worn.contacts]
    return print_answer(
        as_json, DONE if result.outcome.ok else FAILED, {"outcome": result.outcome.name, "contacts": contacts},
        [f"{loaded.name}: {result.outcome}", *lines(worn, deep)], [path, drawn(worn, picture)],
    )  # fmt: skip


def drawn(worn: Wear, path: Path | None) -> Path | None:
    """Draw the wear depth around pins. Returns the written file. None if the user requests no file, or if no contact surrounds a
    pin."""
    around = [(f"{c.joint}, contact {c.contact}", c.angles, c.on_pin, c.on_bearing) for c in worn.contacts if c.angles.size]
    if path is None or not around:
        return None
    from trunnion.plots.analysis.wear_around_pins import draw_wear
    from trunnion.plots.style.figure_files import save_figure

    return save_figure(draw_wear(around), path)


def lines(worn: Wear, depth: float | None) -> list[str]:
    """A row for each contact."""
    rows = []
    for c in worn.contacts:
        numbers = [c.volume * 1e9, max(c.depth) * 1e6, c.pv * 1e-6, c.energy * 1e-6]
        numbers += [c.cycles(depth)] if depth is not None else []
        cells = ["" if math.isnan(x) else number(x, 4) for x in numbers]
        rows.append([f"{c.joint}.contact[{c.contact}]", number(c.distance), number(c.load), *cells])
    return table([*COLUMNS, *(["runs to that depth"] if depth is not None else [])], rows)
