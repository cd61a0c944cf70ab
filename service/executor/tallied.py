"""Tallies beside the parts of very large jobs (``engine/batch/tally.py``): made by the workers, before the parts they are of; where
one is missing or spoilt, it follows from its part."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from engine.batch.plan import Plan
from engine.batch.tally import Tally, packed, tally_of, together, unpacked
from engine.studies.following import Told
from service.executor.parts import Parts
from service.executor.sealed import Piece, Spoiled, opened

if TYPE_CHECKING:
    import pyarrow

log = logging.getLogger("trunnion.service")
MANY = 2_000_000
"""Questions to jobs of no more cases are answered from all their rows, as always; of more, from tallies."""
AT_ONCE = 64
"""Tallies that are read and added up at one time."""


def is_tallied(plan: Plan) -> bool:
    """Whether a job's pieces have tallies beside them."""
    return plan.cases.count > MANY and not isinstance(plan.cases.values, Told)


def write_tally(parts: Parts, piece: Piece, plan: Plan, table: pyarrow.Table) -> int:
    """Keep the tally of a piece's rows; its size in bytes."""
    return parts.write_table(parts.tally(piece), piece.of_tally, packed(tally_of(table, plan.cases, plan.reductions)))


def tallies(parts: Parts, pieces: Sequence[Piece], plan: Plan) -> Iterator[Tally | Piece]:
    """The tallies of pieces, some at a time added up; a piece itself where neither its tally nor its part is what was written."""
    for k in range(0, len(pieces), AT_ONCE):
        some = pieces[k : k + AT_ONCE]
        there = parts.read_many([parts.tally(p) for p in some])
        found: list[Tally] = []
        for piece, data in zip(some, there, strict=True):
            try:
                found.append(_tally(parts, piece, plan, data))
            except Spoiled:
                yield piece
        if found:
            yield together(found, plan.cases) if len(found) > 1 else found[0]


def _tally(parts: Parts, piece: Piece, plan: Plan, data: bytes | None) -> Tally:
    """The tally that was read, else that of the part."""
    try:
        if data is not None:
            return unpacked(opened(data, piece.of_tally))
        why = "it is not there"
    except Spoiled as e:
        why = str(e)
    return _again(parts, piece, plan, why)


def _again(parts: Parts, piece: Piece, plan: Plan, why: str) -> Tally:
    """The tally of a piece from its part, kept for the next time; Spoiled where that is not what was written."""
    log.info("job %s, cases %d to %d: %s; its tally is made of its part", piece.job, piece.start, piece.stop - 1, why)
    table = parts.read_part(piece)[0]
    with suppress(OSError):  # whoever asks next makes it again
        write_tally(parts, piece, plan, table)
    return tally_of(table, plan.cases, plan.reductions)
