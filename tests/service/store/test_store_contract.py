"""The contract that every store fulfils, with any database."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import pytest
from alembic import command

from tests.service.store.single_chunks import chunk_done, chunk_lost, cut
from trunnion.basics.errors import SceneError
from trunnion.service.api.transport.api_keys_and_rates import new_key
from trunnion.service.store.database_connection import Unreachable, alembic_config, transaction
from trunnion.service.store.job_store import BadCursor, Conflict
from trunnion.service.store.leases_and_chunks import ChunkReport, LeaseLost, WorkStore
from trunnion.service.store.store_records import Job

ME, OTHER = "server a", "server b"


@pytest.fixture
def store(database_url: str) -> Iterator[WorkStore]:
    s = WorkStore(database_url)
    s.upgrade()
    yield s
    s.close()


def submitted(s: WorkStore, cases: int = 100, **more: Any) -> Job:
    given = {
        "owner": "me",
        "digest": "d",
        "scene": "arm",
        "label": "",
        "document": '{"a": 1}',
        "cases": cases,
        "budget": 60.0,
    } | more
    return s.submit(**given)[0]


def taken(s: WorkStore, cases: int = 100, server: str = ME) -> Job:
    job = submitted(s, cases)
    assert job.id in [j.id for j in s.claim(server, 60.0)]
    s.begin(server, job.id)
    return job


def test_a_submitted_job_is_stored_with_its_event(store: WorkStore) -> None:
    job = submitted(store, label="ünïcode ☃")
    again = store.job(job.id)
    assert again == job
    assert (job.state, job.cases, job.done, job.counts, job.label) == ("queued", 100, 0, {}, "ünïcode ☃")
    assert store.document(job.id) == {"a": 1}
    assert [e.kind for e in store.events(job.id)] == ["submitted"]


def test_the_same_key_and_request_is_the_same_job_and_another_request_a_conflict(store: WorkStore) -> None:
    first, new = store.submit("me", "d", "arm", "", "{}", 5, 1.0, "k")
    again, newer = store.submit("me", "d", "arm", "", "{}", 5, 1.0, "k")
    assert (first.id, new, newer) == (again.id, True, False)
    assert store.submit("you", "d", "arm", "", "{}", 5, 1.0, "k")[1]
    with pytest.raises(Conflict):
        store.submit("me", "other", "arm", "", "{}", 5, 1.0, "k")


def test_a_key_submitted_by_many_at_once_makes_one_job(store: WorkStore) -> None:
    with ThreadPoolExecutor(8) as pool:
        made = [f.result() for f in [pool.submit(store.submit, "me", "d", "arm", "", "{}", 5, 1.0, "k") for _ in range(16)]]
    assert len({j.id for j, _ in made}) == 1
    assert sum(new for _, new in made) == 1


def test_pages_of_the_list_are_the_list_even_while_jobs_are_added(store: WorkStore) -> None:
    ids = [submitted(store, scene="arm" if i % 2 else "leg").id for i in range(11)]
    page, cursor = store.page(limit=4)
    submitted(store)
    got = [j.id for j in page]
    while cursor:
        page, cursor = store.page(limit=4, cursor=cursor)
        got += [j.id for j in page]
    assert got == ids[::-1]
    assert [j.id for j in store.page(scene="leg")[0]] == ids[::2][::-1]
    assert store.page(state="done")[0] == []
    with pytest.raises(BadCursor):
        store.page(cursor="x" * 10)


def test_chunks_cover_every_case_once_however_many_servers_cut(store: WorkStore) -> None:
    job = taken(store, 1000)
    with ThreadPoolExecutor(6) as pool:
        got = [f.result() for f in [pool.submit(cut, store, ME, job.id, 7 + i % 5) for i in range(150)]]
    ranges = sorted((c.start, c.stop) for c in got if c)
    assert ranges[0][0] == 0
    assert ranges[-1][1] == 1000
    assert all(a[1] == b[0] for a, b in pairwise(ranges))


def test_a_job_is_done_when_all_its_chunks_are_and_its_counts_are_theirs(store: WorkStore) -> None:
    job = taken(store, 25)
    while chunk := cut(store, ME, job.id, 10):
        assert store.end_if_over(ME, job.id) is None
        n = chunk.stop - chunk.start
        for _ in range(2):  # a result that is reported twice counts once
            chunk_done(store, ME, job.id, chunk.start, ChunkReport({"done": n - 1, "no_solution": 1}, 0.5, 0.0, 10))
    assert store.end_if_over(ME, job.id) == "done"
    end = store.job(job.id)
    assert end is not None
    assert (end.state, end.done, end.counts, end.seconds, end.bytes) == ("done", 25, {"done": 22, "no_solution": 3}, 1.5, 30)
    assert [(c.start, c.stop) for c in store.finished(job.id)] == [(0, 10), (10, 20), (20, 25)]
    assert [a["result"] for a in store.attempts(job.id)] == ["done"] * 3
    assert [e.kind for e in store.events(job.id)] == ["submitted", "started", "done"]


def test_parts_of_some_cases_are_found_without_listing_all(store: WorkStore) -> None:
    job = taken(store, 100)
    while chunk := cut(store, ME, job.id, 10):
        chunk_done(store, ME, job.id, chunk.start, ChunkReport({"done": 10}, 0.5, 0.0, 10))
    assert [c.start for c in store.finished(job.id, 35, 60)] == [30, 40, 50]
    assert [c.start for c in store.finished(job.id, 40, 41)] == [40]
    assert store.finished(job.id, 100) == []
    assert store.finished(job.id) == store.finished(job.id, 0, 100)


def test_a_lost_chunk_is_tried_again_and_fails_clearly_in_the_end(store: WorkStore) -> None:
    job = taken(store, 20)
    first, second = cut(store, ME, job.id, 10), cut(store, ME, job.id, 10)
    assert first is not None
    assert second is not None
    chunk_done(store, ME, job.id, second.start, ChunkReport({"done": 10}, 1.0, 0.0, 1))
    for attempt in range(1, 4):
        state = chunk_lost(store, ME, job.id, first.start, "disk full", 3, 0.0)
        assert state == ("failed" if attempt == 3 else "waiting")
        if state == "waiting":
            again = cut(store, ME, job.id, 99)
            assert again is not None
            assert (again.start, again.stop, again.attempts) == (0, 10, attempt + 1)
    assert store.end_if_over(ME, job.id) == "failed"
    end = store.job(job.id)
    assert end is not None
    assert (end.done, end.lost) == (10, 10)
    assert "disk full" in end.problems[0]["what"]
    assert [c.start for c in store.finished(job.id)] == [10]


def test_an_attempt_without_blame_is_not_counted_and_a_retry_waits_its_time(store: WorkStore) -> None:
    job = taken(store, 10)
    cut(store, ME, job.id, 10)
    assert chunk_lost(store, ME, job.id, 0, "scheduler gone", 1, 0.0, blame=False) == "waiting"
    assert cut(store, ME, job.id, 10) is not None
    assert chunk_lost(store, ME, job.id, 0, "error", 2, 1000.0) == "waiting"
    assert cut(store, ME, job.id, 10) is None


def test_a_lease_keeps_others_away_until_it_runs_out(store: WorkStore) -> None:
    job = taken(store)
    assert store.claim(OTHER, 60.0) == []
    with pytest.raises(LeaseLost):
        cut(store, OTHER, job.id, 5)
    store.claim(ME, 0.05)
    time.sleep(0.1)
    assert [j.id for j in store.claim(OTHER, 60.0)] == [job.id]
    for write in (
        lambda: cut(store, ME, job.id, 5),
        lambda: store.end(ME, job.id, "done", []),
        lambda: store.end_if_over(ME, job.id),
    ):
        with pytest.raises(LeaseLost):
            write()


def test_released_leases_are_free_at_once(store: WorkStore) -> None:
    job = taken(store)
    store.release(ME)
    assert [j.id for j in store.claim(OTHER, 60.0)] == [job.id]


def test_a_queued_job_is_cancelled_at_once_and_a_running_one_by_its_server(store: WorkStore) -> None:
    idle, busy = submitted(store), submitted(store)
    cancelled = store.cancel(idle.id)
    assert cancelled is not None
    assert cancelled.state == "cancelled"
    store.claim(ME, 60.0)
    store.begin(ME, busy.id)
    cut(store, ME, busy.id, 10)
    going = store.cancel(busy.id)
    assert going is not None
    assert going.state == "cancelling"
    assert [j.state for j in store.claim(ME, 60.0)] == ["cancelling"]
    store.end(ME, busy.id, "cancelled", [])
    assert [j.state for j in (store.cancel(busy.id), store.cancel(idle.id)) if j] == ["cancelled", "cancelled"]
    assert store.running(busy.id) == []
    assert store.cancel("none") is None
    assert store.states()["cancelled"] == 2


def test_every_time_that_is_kept_is_by_the_databases_clock(store: WorkStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "now", lambda c: 4e9)
    queued = submitted(store)
    store.cancel(queued.id)
    job = taken(store)
    store.end(ME, job.id, "failed", [])
    for i in (queued.id, job.id):
        found = store.job(i)
        assert found is not None
        assert (found.created, found.finished) == (4e9, 4e9)
        assert {e.time for e in store.events(i)} == {4e9}


def test_keys_are_found_until_they_are_revoked(store: WorkStore) -> None:
    key, secret = new_key("me", "submit")
    store.add_key(key)
    assert store.key(key.id) == key
    assert secret not in repr(store.all_keys())
    assert store.revoke(key.id)
    assert not store.revoke(key.id)
    found = store.key(key.id)
    assert found is not None
    assert found.revoked is not None


LATER = {
    "jobs": ("pace", "landed", "beat", "lease", "tags", "notify", "asked", "ends"),
    "chunks": ("counts", "bytes", "version"),
}
"""Columns that the first version lacked."""


def test_tables_of_the_first_version_become_those_of_the_code_and_keep_their_jobs(store: WorkStore) -> None:
    job = submitted(store)
    with transaction(store.engine, writing=True) as c:
        for later in ("TABLE audit", "TABLE hooks", "INDEX ix_jobs_owner_created"):
            c.exec_driver_sql(f"DROP {later}")
        for table, columns in LATER.items():
            for name in columns:
                c.exec_driver_sql(f"ALTER TABLE {table} DROP COLUMN {name}")
        command.stamp(alembic_config(c), "0001", purge=True)
    store.upgrade()
    with transaction(store.engine, writing=True) as c:
        command.check(alembic_config(c))
    store.upgrade()
    assert store.job(job.id) == job


def test_a_database_that_cannot_be_reached_is_reported_as_unreachable() -> None:
    s = WorkStore("postgresql://nobody@127.0.0.1:1/none")
    with pytest.raises(Unreachable):
        s.ping()


@pytest.mark.parametrize("url", ["mysql://x/y", "nonsense", "sqlite://", "sqlite:///:memory:"])
def test_an_address_that_is_no_durable_database_is_refused(url: str) -> None:
    with pytest.raises(SceneError, match="--database"):
        WorkStore(url)
