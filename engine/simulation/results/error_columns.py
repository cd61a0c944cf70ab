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
    """The result with an additional column ``time.error``, and an error column for each column with a stated error. A result
    without a certainty is returned unchanged."""
    c = result.certainty
    if c is None:
        return result
    places = [i for i, f in enumerate(c.floor) if np.isfinite(f)]
    about = [("time", "s", "error of the time of events near this row")]
    about += [(c.names[i], c.units[i], f"approximate bound of the global error of {c.names[i]}") for i in places]
    extra = tuple(Column(name + ENDING, unit, text, "error", (name,)) for name, unit, text in about)
    data = np.column_stack([result.data, c.shift, c.error[:, places]])
    return replace(result, data=data, columns=(*result.columns, *extra), certainty=None)
