"""Many chunks in one commit are stored as in separate commits, in any database. A commit stores all chunks or none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from tests.service.store.single_chunks import chunk_done, chunk_lost, cut
from tests.service.store.test_store_contract import ME, OTHER, store, taken
from trunnion.service.store.leases_and_chunks import ChunkReport, FailedAttempt, LeaseLost, WorkStore
from trunnion.service.store.store_records import Job

__all__ = ["store"]


def test_many_chunks_cut_at_once_are_those_that_are_cut_one_by_one(store: WorkStore) -> None:
    """Due retries come first, then new cases, then cases that overran. The numbers of attempts are equal."""

    def begun() -> Job:
        job = taken(store, 100)
        for _ in range(4):
            cut(store, ME, job.id, 10)
        chunk_done(store, ME, job.id, 10, ChunkReport({"done": 3}, 1.0, 0.0, 1, reached=13))
        for start in (30, 0):
            chunk_lost(store, ME, job.id, start, "disk full", 5, 0.0)
        chunk_lost(store, ME, job.id, 20, "disk full", 5, 1000.0)
        return job

    one, many = begun(), begun()
    sizes = [7, 9, 11, 13, 15, 40, 5, 5, 5, 5]
    single = [x for size in sizes if (x := cut(store, ME, one.id, size))]
    together = store.cut_chunks(ME, many.id, sizes[:5]) + store.cut_chunks(ME, many.id, sizes[5:])
    assert [replace(x, job="", not_before=0.0) for x in single] == [replace(x, job="", not_before=0.0) for x in together]
    assert [x.start for x in together[:4]] == [0, 14, 17, 30]
    assert (together[-1].start, together[-1].stop) == (13, 14), "the case that overran"
    of = [[(a["start"], a["ended"] is None) for a in store.attempts(j.id)] for j in (one, many)]
    assert of[0] == of[1]
    assert store.cut_chunks(ME, many.id, sizes) == []
    with pytest.raises(LeaseLost):
        store.cut_chunks(OTHER, many.id, sizes)


def test_many_chunks_recorded_at_once_have_the_results_of_chunks_recorded_one_by_one(store: WorkStore) -> None:
    def cut() -> Job:
        job = taken(store, 100)
        assert len(store.cut_chunks(ME, job.id, [10] * 10)) == 10
        return job

    done = {10 * k: ChunkReport({"done": 9, "stuck": 1}, 0.5, 0.25, 7, f"w{k}", reached=45 if k == 4 else None) for k in range(6)}
    done[40] = replace(done[40], counts={"done": 5})
    lost = {60: FailedAttempt("disk full", 0.0), 70: FailedAttempt("gone", 0.0, False), 80: FailedAttempt("disk full", 0.0)}
    one, many = cut(), cut()
    for start, d in done.items():
        chunk_done(store, ME, one.id, start, d)
    states = {s: chunk_lost(store, ME, one.id, s, x.error, 1, x.delay, x.blame) for s, x in lost.items()}
    for _ in range(2):  # a result that is reported twice counts once
        assert store.record_outcomes(ME, many.id, done, lost, 1) == states == {60: "failed", 70: "waiting", 80: "failed"}
    ends = [store.job(j.id) for j in (one, many)]
    same = ("done", "lost", "counts", "seconds", "build_seconds", "bytes", "planned")
    assert len({str([getattr(j, n) for n in same]) for j in ends}) == 1
    for seen in (
        lambda j: [(c.start, c.stop) for c in store.finished(j.id)],
        lambda j: [(c.start, c.stop) for c in store.running(j.id)],
        lambda j: [(a["start"], a["worker"], a["result"]) for a in store.attempts(j.id)],
        lambda j: sorted((e.kind, str(e.data)) for e in store.events(j.id)),
    ):
        assert seen(one) == seen(many)
    with pytest.raises(LeaseLost):
        store.record_outcomes(OTHER, many.id, done, lost)


def test_last_outcomes_end_a_job_as_two_commits_do(store: WorkStore) -> None:
    done, gone = ChunkReport({"done": 10}, 0.5, 0.25, 7, "w"), FailedAttempt("disk full", 0.0)
    for lost, end in (({}, None), ({10: gone, 20: gone}, "failed")):
        one, many = taken(store, 30), taken(store, 30)
        for job in (one, many):
            store.cut_chunks(ME, job.id, [10] * 3)
        apart = store.record_outcomes(ME, one.id, {0: done}, lost, 1), store.end_if_over(ME, one.id)
        assert store.record_last_outcomes(ME, many.id, {0: done}, lost, 1) == apart
        assert apart[1] == end
        seen = [store.job(j.id) for j in (one, many)]
        assert len({str([getattr(j, n) for n in ("state", "done", "lost", "counts", "problems", "ends")]) for j in seen}) == 1
    with pytest.raises(LeaseLost):
        store.record_last_outcomes(OTHER, taken(store, 10).id, {}, {}, 1)


def test_many_chunks_recorded_at_once_are_all_stored_or_none(store: WorkStore, monkeypatch: pytest.MonkeyPatch) -> None:
    job = taken(store, 30)
    store.cut_chunks(ME, job.id, [10] * 3)

    def broken(*given: Any) -> None:
        raise ValueError("in the midst of it")

    monkeypatch.setattr(store, "_events", broken)
    with pytest.raises(ValueError, match="midst"):
        store.record_outcomes(ME, job.id, {0: ChunkReport({"done": 10}, 1.0, 0.0, 1)}, {10: FailedAttempt("gone", 0.0)}, 5)
    assert [c.start for c in store.running(job.id)] == [0, 10, 20]
    end = store.job(job.id)
    assert end is not None
    assert (end.done, end.seconds) == (0, 0.0)


def test_where_pieces_end_is_kept_with_a_job_that_is_done_until_some_are_made_again(store: WorkStore) -> None:
    def ended(sizes: tuple[int, ...]) -> Job:
        job = taken(store, sum(sizes))
        for chunk in store.cut_chunks(ME, job.id, sizes):
            chunk_done(store, ME, job.id, chunk.start, ChunkReport({"done": chunk.stop - chunk.start}, 0.5, 0.0, 10))
        going = store.job(job.id)
        assert going is not None
        assert going.ends == ""
        assert store.end_if_over(ME, job.id) == "done"
        return store.job(job.id) or going

    one, same, other = ended((10, 20)), ended((10, 20)), ended((20, 10))
    assert one.ends == same.ends == store.ends(one.id) != other.ends
    store.reopen_chunk(one.id, 10, "spoilt")
    again = store.job(one.id)
    assert again is not None
    assert (again.state, again.ends) == ("running", "")
