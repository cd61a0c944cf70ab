"""What the parts of a job tell the study whose cases they hold."""

from __future__ import annotations

import logging

from engine.studies.following import Follow, Seen, seen_of
from service.executor.parts import Parts
from service.executor.sealed import Piece, Spoiled
from service.store.work import WorkStore

log = logging.getLogger("trunnion.service")


def seen_in(store: WorkStore, parts: Parts, job: str, document: str, follow: Follow) -> Seen | None:
    """The results of the round that a study waits for; None while some of it are not there. A part that is not what was written is
    computed again first; a case that could not be run in all its attempts counts as lost."""
    import pyarrow as pa

    start, stop, names = follow.known, follow.asked, follow.study.results
    there = store.ended(job, start, stop)
    if sum(min(c.stop, stop) - max(c.start, start) for c in there) < stop - start:
        return None
    tables = []
    for chunk in (c for c in there if c.state == "done"):
        try:
            tables.append(parts.read_part(Piece(job, document, chunk.start, chunk.stop), ["case", "outcome", *names])[0])
        except Spoiled as e:
            log.warning("job %s, cases %d to %d: %s; they are computed again", job, chunk.start, chunk.stop - 1, e)
            store.reopen(job, chunk.start, str(e))
            return None
    shape = pa.schema([("case", pa.int64()), ("outcome", pa.string()), *((n, pa.float64()) for n in names)])
    return seen_of(pa.concat_tables([shape.empty_table(), *(t.cast(shape) for t in tables)]), start, stop, names)
