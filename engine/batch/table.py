"""The table of a batch: one row a case, with its numbers, how it ended, and its reductions; Arrow with units."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.basics import arrow
from engine.basics.version import version
from engine.batch.reductions import Reduction, about_errors
from engine.simulation.audit import WORDS, Audit
from engine.simulation.certainty.stated import REASONS
from engine.simulation.outcome import Outcome

if TYPE_CHECKING:
    import pyarrow

FORMAT = "trunnion sweep 1"
HEAD = ("case", "outcome", "outcome.time", "outcome.joint", "outcome.advice", "audit", "audit.energy", "audit.note", "steps")
"""Columns every table has, beside the paths and the reductions."""
WHY = "error.why"
"""One more, before ``steps``, where errors of reductions are kept."""


def schema(paths: Sequence[str], units: Sequence[str], chosen: Sequence[Reduction], about: dict[str, Any]) -> pyarrow.Schema:
    """The schema of a batch's table: every field has ``unit`` and ``description`` in its metadata, and the schema's own
    metadata say where the table came from."""
    import pyarrow as pa

    def field(name: str, kind: Any, unit: str, text: str) -> Any:
        return pa.field(name, kind, nullable=kind == pa.float64(), metadata={"unit": unit, "description": text})

    fields = [field("case", pa.int64(), "1", "number of the case, from 0")]
    fields += [field(p, pa.float64(), u, "varied") for p, u in zip(paths, units, strict=True)]
    fields += [
        field("outcome", pa.string(), "", "done, or what went wrong"),
        field("outcome.time", pa.float64(), "s", "time reached; of an inaccurate case, when most of the energy was lost or gained"),
        field("outcome.joint", pa.string(), "", "joint it is about"),
        field("outcome.advice", pa.string(), "", "what to try"),
        field("audit", pa.string(), "", f"what the audit says: {', '.join(WORDS.values())}; none of a case that did not start"),
        field("audit.energy", pa.float64(), "1", "largest energy unaccounted for, of the energy turned over"),
        field("audit.note", pa.string(), "", "what is not within the tolerance, when and where"),
    ]
    if about_errors(chosen):
        words = ", ".join(word for word in REASONS if word)
        fields.append(field(WHY, pa.string(), "", f"why no error is stated of the case: {words}; none where errors are"))
    fields.append(field("steps", pa.int64(), "1", "steps taken"))
    fields += [field(r.name, pa.float64(), r.unit, r.description) for r in chosen]
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
    """The table's rows for some cases; ``cases`` (n) are their numbers, ``why`` the reasons, where errors are kept. NaN, where
    there is nothing to reduce, becomes null."""
    import pyarrow as pa

    words = tuple(REASONS)
    arrays = [
        arrow.numbers(cases.astype(np.int64)),
        *(arrow.numbers(column, nulls=True) for column in values.T),
        arrow.texts([o.name for o in outcomes]),
        arrow.numbers(np.array([o.time for o in outcomes], float), nulls=True),
        arrow.texts([o.joint for o in outcomes]),
        arrow.texts([o.advice for o in outcomes]),
        arrow.texts([a.verdict for a in audits]),
        arrow.numbers(np.array([np.nan if a.energy is None else a.share for a in audits], float), nulls=True),
        arrow.texts(["; ".join(a.notes) for a in audits]),
        *([arrow.texts([words[i] for i in why])] if WHY in shape.names else []),
        arrow.numbers(steps.astype(np.int64)),
        *(arrow.numbers(column, nulls=True) for column in numbers.T),
    ]
    return pa.Table.from_arrays(arrays, schema=shape)
