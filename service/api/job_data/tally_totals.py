"""Totals of tallies, for jobs with very many cases. A tally holds mergeable statistics of a part. Each tally is read once. Totals
are cached; totals of ended jobs are also stored."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, Field

from trunnion.batch.sample_statistics.mergeable_statistics import Tally, packed, tally_of, together, unpacked
from trunnion.service.api.job_data.job_rows import MOST_REPAIRS, job_contents, recompute_chunk
from trunnion.service.api.server_state.server_components import JobContents, JobTally, Service
from trunnion.service.executor.part_checksum import CorruptPart, Piece, digest_of, read_part_bytes
from trunnion.service.executor.part_tallies import BATCH, MANY, is_tallied, tallies
from trunnion.service.executor.part_versions import shaped
from trunnion.service.store.store_records import Chunk


class DrawnDocument(BaseModel):
    """The sampled cases from which an answer was computed."""

    cases: int = Field(description="Number of sampled cases; a hash of the case number selects them.")
    of: int = Field(description="Number of finished cases.")


DRAWN = Field(None, description=f"null: the answer covers all cases. Above {MANY} cases, about a million cases are sampled.")


def job_tally(s: Service, job: str) -> Tally | None:
    """The total of the tallies of all finished cases of a job. None for a small job, all of whose rows can be read. CorruptPart
    when a damaged part cannot be recomputed."""
    there = job_contents(s, job)
    if not is_tallied(there.plan):
        return None
    kept = s.tallies.of(job, JobTally)
    with kept.lock:
        chunks = s.store.finished(job)
        spans = {(c.start, c.stop): c for c in chunks}
        if not kept.pieces <= spans.keys():  # some cases were recomputed in other chunks than before
            kept.pieces, kept.tally = set(), None
        ended = sum(c.stop - c.start for c in chunks) == there.plan.cases.count and len(chunks) > BATCH
        all_of = Piece(job, f"{there.digest} all {digest_of(repr(sorted(spans)).encode())}", 0, there.plan.cases.count)
        if ended and kept.tally is None:
            kept.tally = _read_total(s, all_of)
            kept.pieces = set(spans) if kept.tally is not None else set()
        fresh = [c for span, c in spans.items() if span not in kept.pieces]
        if fresh or kept.tally is None:
            _add_chunks(s, kept, there, fresh)
            if ended and kept.pieces == spans.keys() and kept.tally is not None:
                s.parts.write_table(s.parts.all_tally(job), all_of.of_tally, packed(kept.tally))
        return kept.tally


def _read_total(s: Service, all_of: Piece) -> Tally | None:
    """The stored total of an ended job; None if the total is missing or damaged."""
    try:
        return unpacked(read_part_bytes(s.parts.read(s.parts.all_tally(all_of.job)), all_of.of_tally))
    except (CorruptPart, FileNotFoundError):
        return None


def _add_chunks(s: Service, kept: JobTally, there: JobContents, chunks: Iterable[Chunk]) -> None:
    """Add the tallies of chunks to the total. Chunks with damaged tallies and rows are first recomputed."""
    todo, repairs = deque(chunks), 0
    found, pieces = [kept.tally] if kept.tally is not None else [], set(kept.pieces)
    while todo:
        some = {c.start: c for c in (todo.popleft() for _ in range(min(len(todo), BATCH)))}
        for got in tallies(s.parts, [Piece(c.job, there.digest, c.start, c.stop) for c in some.values()], there.plan):
            if isinstance(got, Tally):
                found.append(got)
                continue
            repairs += 1
            if repairs > MOST_REPAIRS * (1 + len(todo)):
                raise CorruptPart(f"cases {got.start} to {got.stop - 1} cannot be read")
            todo.extend(recompute_chunk(s, some.pop(got.start), "both the rows and the counts of these cases are damaged"))
        pieces |= {(c.start, c.stop) for c in some.values()}
        if len(found) >= BATCH:
            found = [together(found, there.plan.cases)]
    nothing = tally_of(there.plan.schema.empty_table(), there.plan.cases, there.plan.reductions)
    kept.tally, kept.pieces = together(found, there.plan.cases) if found else nothing, pieces


def sample_document(tally: Tally | None) -> dict[str, Any] | None:
    """The document of the numbers of sampled and of all finished cases."""
    return None if tally is None else {"cases": len(tally.drawn), "of": tally.cases}


def note_on_sample(note: str, drawn: dict[str, Any] | None) -> dict[str, str]:
    """The note. If cases were sampled, the sample size is added."""
    some = drawn is not None and drawn["cases"] < drawn["of"]
    return {"note": f"{note}; {drawn['cases']} of {drawn['of']} cases, selected at random" if some and drawn else note}


def sampled_rows(tally: Tally, shown: Any) -> Any:
    """The sampled rows in the order of their cases, with the columns of the schema ``shown``."""
    return shaped(tally.drawn.sort_by("case"), shown)
