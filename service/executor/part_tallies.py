"""Tallies of the parts of very large jobs (``engine/batch/sample_statistics/mergeable_statistics.py``). A worker writes the tally
of a piece before its part. A missing or damaged tally is computed from the part."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from trunnion.analysis.studies.case_rounds import ReportedCases
from trunnion.batch.plan import Plan
from trunnion.batch.sample_statistics.mergeable_statistics import Tally, packed, tally_of, together, unpacked
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_checksum import CorruptPart, Piece, read_part_bytes

if TYPE_CHECKING:
    import pyarrow

log = logging.getLogger("trunnion.service")
MANY = 2_000_000
"""Queries of jobs with more cases than this use tallies. Queries of other jobs read all rows."""
BATCH = 64
"""Number of tallies that are read and merged at a time."""


def is_tallied(plan: Plan) -> bool:
    """Whether the chunks of a job have tallies."""
    return plan.cases.count > MANY and not isinstance(plan.cases.values, ReportedCases)


def write_tally(parts: Parts, piece: Piece, plan: Plan, table: pyarrow.Table) -> int:
    """Write the tally of a piece's rows; returns its size in bytes."""
    return parts.write_table(parts.tally(piece), piece.of_tally, packed(tally_of(table, plan.cases, plan.reductions)))


def tallies(parts: Parts, pieces: Sequence[Piece], plan: Plan) -> Iterator[Tally | Piece]:
    """Merged tallies of the pieces, and each piece whose tally and part are both damaged."""
    for k in range(0, len(pieces), BATCH):
        some = pieces[k : k + BATCH]
        there = parts.read_many([parts.tally(p) for p in some])
        found: list[Tally] = []
        for piece, data in zip(some, there, strict=True):
            try:
                found.append(_read_tally(parts, piece, plan, data))
            except CorruptPart:
                yield piece
        if found:
            yield together(found, plan.cases) if len(found) > 1 else found[0]


def _read_tally(parts: Parts, piece: Piece, plan: Plan, data: bytes | None) -> Tally:
    """The stored tally of a piece. If the stored tally is missing or damaged, the tally is computed from the part and
    stored. Raises CorruptPart when the part is damaged, too."""
    try:
        if data is not None:
            return unpacked(read_part_bytes(data, piece.of_tally))
        why = "it is missing"
    except CorruptPart as e:
        why = str(e)
    log.info("job %s, cases %d to %d: %s; its tally is computed from its part", piece.job, piece.start, piece.stop - 1, why)
    table = parts.read_part(piece)[0]
    with suppress(OSError):  # if the write fails, the next query computes the tally again
        write_tally(parts, piece, plan, table)
    return tally_of(table, plan.cases, plan.reductions)
