"""Takes over the parts of earlier versions. A part that an earlier version wrote without identity and checksum gets an identity and
a checksum. The rows of the part do not change."""

from __future__ import annotations

import logging
from functools import lru_cache

from trunnion.basics.arrow_columns import count_by
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import (
    MARK,
    CaseRange,
    CorruptPart,
    checksummed_bytes,
    digest_of,
    document_bytes,
    read_part_bytes,
)
from trunnion.service.store.leases_and_chunks import WorkStore
from trunnion.service.store.store_records import Chunk

log = logging.getLogger("trunnion.service")
AT_ONCE = 1000


def adopt_parts(store: WorkStore, parts: Parts) -> None:
    """Examine the parts of all finished chunks of earlier versions. A damaged part does not change. When the part is read, its
    cases are computed again."""

    @lru_cache(maxsize=64)
    def digest(job: str) -> str:
        return digest_of(document_bytes(store.document(job)))

    sealed = damaged = 0
    while found := store.unexamined(AT_ONCE):
        for chunk in found:
            try:
                sealed += _adopt(store, parts, chunk, CaseRange(chunk.job, digest(chunk.job), chunk.start, chunk.stop))
            except (CorruptPart, FileNotFoundError) as e:
                place = (chunk.job, chunk.start, chunk.stop - 1)
                log.warning("job %s, cases %d to %d: %s; a request for these rows computes them again", *place, e)
                store.adopt(chunk, {}, 0)
                damaged += 1
    if sealed or damaged:
        log.warning("parts of an earlier version: %d got a checksum, their rows are unchanged; %d are damaged", sealed, damaged)


def _adopt(store: WorkStore, parts: Parts, chunk: Chunk, case_range: CaseRange) -> bool:
    """Examine the part of a chunk. Returns whether the part got a checksum."""
    path = parts.part(case_range)
    if MARK in parts.read_end(path) or (data := checksummed_bytes(parts.read(path), case_range)) is None:
        store.adopt(chunk, {}, 0)
        return False
    parts.write(path, data)
    store.adopt(chunk, count_by(read_part_bytes(data, case_range, ["outcome"])), len(data))
    return True
