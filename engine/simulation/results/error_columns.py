"""Stated errors as columns of a result."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from trunnion.kernel.interface.output_columns import Column

if TYPE_CHECKING:
    from trunnion.simulation.results.result_data import ResultData

ENDING = ".error"
"""Suffix of the names of error columns."""


def with_errors(result: ResultData) -> ResultData:
    """The result with additional columns ``time.error`` and one for each column with an error; unchanged without a certainty."""
    c = result.certainty
    if c is None:
        return result
    places = [i for i, f in enumerate(c.floor) if np.isfinite(f)]
    about = [("time", "s", "error of the time of events near this row")]
    about += [(c.names[i], c.units[i], f"global error of {c.names[i]}: at most about") for i in places]
    extra = tuple(Column(name + ENDING, unit, text, "error", (name,)) for name, unit, text in about)
    data = np.column_stack([result.data, c.shift, c.error[:, places]])
    return replace(result, data=data, columns=(*result.columns, *extra), certainty=None)
