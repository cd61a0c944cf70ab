"""Writes to the store about one chunk at a time."""

from __future__ import annotations

from trunnion.service.store.leases_and_chunks import ChunkReport, FailedAttempt, WorkStore
from trunnion.service.store.store_records import Chunk


def cut(store: WorkStore, server: str, job: str, size: int, pause: float = 3000.0) -> Chunk | None:
    """The next chunk to run; None if there is no chunk."""
    found = store.cut_chunks(server, job, [size], pause)
    return found[0] if found else None


def chunk_done(store: WorkStore, server: str, job: str, start: int, done: ChunkReport) -> None:
    """Record that a chunk is done."""
    store.record_outcomes(server, job, {start: done})


def chunk_lost(store: WorkStore, server: str, job: str, start: int, error: str, most: int, delay: float, blame: bool = True) -> str:
    """Record a failed attempt; returns the state of the chunk."""
    return store.record_outcomes(server, job, {}, {start: FailedAttempt(error, delay, blame)}, most)[start]
