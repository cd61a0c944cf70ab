"""What is kept of every case of a sweep beside its reductions: their errors; rows, which columns, how far apart, where they go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from engine.cli import options
from engine.cli.options import Findings
from engine.cli.simulating import TABLES


@dataclass(frozen=True)
class Kept:
    """The words of the options: patterns of columns, spacing, where the rows go; certify: whether errors are kept."""

    patterns: Sequence[str] = ()
    spacing: str | None = None
    rows: str | None = None
    certify: bool = False

    def planned(self, found: Findings) -> dict[str, Any]:
        """What a plan is asked for; mistakes are noted."""
        spacing = spaced(self.spacing, bool(self.patterns), found)
        return {"trajectories": tuple(self.patterns), "spacing": spacing, "certify": self.certify}

    def place(self, found: Findings) -> Path | None:
        """Where the rows go; mistakes are noted."""
        if self.patterns and self.rows is None:
            found.add("--trajectories", "nothing says where the rows go", "add --rows FILE, such as rows.parquet")
        if self.rows is not None and not self.patterns:
            found.add("--rows", "no rows are kept", "name their columns, such as --trajectories 'ball.*'")
        if self.rows is None or Path(self.rows).suffix:
            return options.destination(self.rows, TABLES, "--rows", found)
        folder = Path(self.rows)
        if folder.is_file():
            found.add("--rows", f"{self.rows!r} is a file", "end it in .csv or .parquet, or choose another folder")
        elif not folder.absolute().parent.is_dir():
            found.add("--rows", f"the folder {str(folder.parent)!r} does not exist", "create it, or choose another")
        return folder


def spaced(text: str | None, some: bool, found: Findings) -> float | None:
    """A spacing, s; mistakes are noted. some: whether there are rows that it is of."""
    if text is not None and not some:
        found.add("--spacing", "no rows are kept", "name their columns, such as --trajectories 'ball.*'")
        return None
    value = None if text is None else options.quantity(text, "s", "--spacing", found)
    if value is not None and not value > 0.0:
        found.add("--spacing", f"{text} is not a positive time", "write a time such as 0.1 or 10 ms")
        return None
    return value
