"""Errors beside the numbers they belong to: as columns of a table, and as words."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from engine.kernel.columns import Column

if TYPE_CHECKING:
    from engine.simulation.result import Result

ENDING = ".error"
"""What the name of a column's error ends with."""


def with_errors(result: Result) -> Result:
    """The result with its errors as columns behind the others: ``time.error`` and one for each column that has one; itself where it
    has no certainty."""
    c = result.certainty
    if c is None:
        return result
    places = [i for i, f in enumerate(c.floor) if np.isfinite(f)]
    about = [("time", "s", "events near this row may be earlier or later by")]
    about += [(c.names[i], c.units[i], f"global error of {c.names[i]}: at most about") for i in places]
    extra = tuple(Column(name + ENDING, unit, text, ("error", name)) for name, unit, text in about)
    data = np.column_stack([result.data, c.shift, c.error[:, places]])
    return replace(result, data=data, columns=(*result.columns, *extra), certainty=None)
