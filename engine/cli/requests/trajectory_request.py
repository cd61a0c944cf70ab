"""The columns that a sweep stores over time for every case: patterns of the columns, spacing of the rows, file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from trunnion.cli.options.argument_reader import TABLES, ArgumentReader
from trunnion.cli.options.option_declarations import repeatable

NO_ROWS = ("no rows are stored", "name their columns, such as --trajectories 'ball.*'")
Trajectories = Annotated[
    list[str], repeatable("--trajectories", metavar="PATTERN", help="For every case, store these columns over time.")
]
Spacing = Annotated[
    str | None, typer.Option("--spacing", metavar="DT", help="Spacing of the stored rows, s.", show_default="all rows")
]
Certify = Annotated[bool, typer.Option("--certify", help="Also compute the error of each result; each case then runs twice.")]


def trajectory_arguments(patterns: Sequence[str], spacing: str | None, certify: bool, reader: ArgumentReader) -> dict[str, Any]:
    """The arguments of ``plan`` for trajectories and errors. Mistakes are added to ``reader``."""
    if spacing is not None and not patterns:
        reader.add("--spacing", *NO_ROWS)
    return {
        "trajectories": tuple(patterns),
        "spacing": reader.time(spacing if patterns else None, "--spacing"),
        "certify": certify,
    }


def rows_destination(rows: str | None, patterns: Sequence[str], reader: ArgumentReader) -> Path | None:
    """The file or folder for the stored rows. Mistakes are added to ``reader``."""
    if patterns and rows is None:
        reader.add("--trajectories", "no file for the stored rows is given", "add --rows FILE, such as rows.parquet")
    if rows is not None and not patterns:
        reader.add("--rows", *NO_ROWS)
    if rows is None or Path(rows).suffix:
        return reader.destination(rows, TABLES, "--rows")
    folder = Path(rows)
    if folder.is_file():
        reader.add("--rows", f"{rows!r} is a file", "end it in .csv or .parquet, or choose another folder")
    elif not folder.absolute().parent.is_dir():
        reader.add("--rows", f"the folder {str(folder.parent)!r} does not exist", "create the folder, or choose another")
    return folder
