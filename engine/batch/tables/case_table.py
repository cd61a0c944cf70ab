"""The Arrow table of a batch. Each case has a row with its varied numbers, outcome and reductions. Fields have units."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics import arrow_columns
from trunnion.basics.arrow_columns import field
from trunnion.basics.version import version
from trunnion.batch.tables.reductions import Reduction, about_errors
from trunnion.simulation.results.audit import WORDS, Audit
from trunnion.simulation.results.error_statement import REASONS
from trunnion.simulation.results.outcome import Outcome

if TYPE_CHECKING:
    import pyarrow

FORMAT = "trunnion sweep 1"
WHY = "error.why"
"""Name of the column with the reason for missing errors. Tables have this column if the reductions include errors."""


def schema(paths: Sequence[str], units: Sequence[str], chosen: Sequence[Reduction], about: dict[str, Any]) -> pyarrow.Schema:
    """The schema of a batch's table. The metadata of every field hold ``unit`` and ``description``; the metadata of the schema
    state the table's origin."""
    import pyarrow as pa

    fields = [field("case", pa.int64(), "1", "number of the case, from 0")]
    fields += [field(p, pa.float64(), u, "varied", True) for p, u in zip(paths, units, strict=True)]
    fields += [
        field("outcome", pa.string(), "", "done, or the failure"),
        field("outcome.time", pa.float64(), "s", "end time; for an inaccurate case: time of the largest energy error", True),
        field("outcome.joint", pa.string(), "", "joint of the failure"),
        field("outcome.advice", pa.string(), "", "remedy"),
        field("audit", pa.string(), "", f"verdict of the audit: {', '.join(WORDS.values())}; none for a case that did not start"),
        field("audit.energy", pa.float64(), "1", "largest energy error, relative to the energy turned over", True),
        field("audit.note", pa.string(), "", "violations and energy errors beyond the tolerance, with time and joint"),
    ]
    if about_errors(chosen):
        words = ", ".join(word for word in REASONS if word)
        fields.append(field(WHY, pa.string(), "", f"reason for missing error estimates: {words}; empty if there are estimates"))
    fields.append(field("steps", pa.int64(), "1", "steps taken"))
    fields += [field(r.name, pa.float64(), r.unit, r.description, True) for r in chosen]
    texts = {"format": FORMAT, "version": version()} | {k: json.dumps(v, ensure_ascii=False) for k, v in about.items()}
    return pa.schema(fields, metadata=texts)


def table(
    shape: pyarrow.Schema,
    cases: np.ndarray,
    values: np.ndarray,
    outcomes: Sequence[Outcome],
    audits: Sequence[Audit],
    steps: np.ndarray,
    numbers: np.ndarray,
    why: np.ndarray,
) -> pyarrow.Table:
    """The rows of n cases. cases (n): case numbers; values: n × paths; numbers: n × reductions; why (n): indices of REASONS. NaN
    becomes null."""
    import pyarrow as pa

    words = tuple(REASONS)
    arrays = [
        arrow_columns.numbers(cases.astype(np.int64)),
        *(arrow_columns.numbers(column, nulls=True) for column in values.T),
        arrow_columns.texts([o.name for o in outcomes]),
        arrow_columns.numbers(np.array([o.time for o in outcomes], float), nulls=True),
        arrow_columns.texts([o.joint for o in outcomes]),
        arrow_columns.texts([o.advice for o in outcomes]),
        arrow_columns.texts([a.verdict for a in audits]),
        arrow_columns.numbers(np.array([np.nan if a.energy is None else a.share for a in audits], float), nulls=True),
        arrow_columns.texts(["; ".join(a.notes) for a in audits]),
        *([arrow_columns.texts([words[i] for i in why])] if WHY in shape.names else []),
        arrow_columns.numbers(steps.astype(np.int64)),
        *(arrow_columns.numbers(column, nulls=True) for column in numbers.T),
    ]
    return pa.Table.from_arrays(arrays, schema=shape)
