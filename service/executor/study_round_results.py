"""Reads the results of the rounds of a study from the parts of its job."""

from __future__ import annotations

import logging

from trunnion.analysis.studies.study_rounds import CaseResults, StudyProgress, results_of
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange, CorruptPart
from trunnion.service.store.leases_and_chunks import WorkStore

log = logging.getLogger("trunnion.service")


def round_results(store: WorkStore, parts: Parts, job: str, document: str, follow: StudyProgress) -> CaseResults | None:
    """The results of the cases for which a study waits. None while results are missing. If a part is damaged, the function
    schedules its cases for recomputation and returns None. A case that failed in all attempts counts as lost."""
    import pyarrow as pa

    start, stop, names = follow.finished, follow.requested, follow.study.results
    there = store.ended(job, start, stop)
    if sum(min(c.stop, stop) - max(c.start, start) for c in there) < stop - start:
        return None
    tables = []
    for chunk in (c for c in there if c.state == "done"):
        try:
            tables.append(parts.read_part(CaseRange(job, document, chunk.start, chunk.stop), ["case", "outcome", *names])[0])
        except CorruptPart as e:
            log.warning("job %s, cases %d to %d: %s; they are recomputed", job, chunk.start, chunk.stop - 1, e)
            store.reopen_chunk(job, chunk.start, str(e))
            return None
    shape = pa.schema([("case", pa.int64()), ("outcome", pa.string()), *((n, pa.float64()) for n in names)])
    return results_of(pa.concat_tables([shape.empty_table(), *(t.cast(shape) for t in tables)]), start, stop, names)
