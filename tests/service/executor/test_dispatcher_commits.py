"""A server needs few commits for many workers. An interruption in the middle of a commit loses no chunk."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from tests.benchmarks.service.dispatcher_with_idle_workers import PendingResult
from trunnion.service.basics.prometheus_metrics import Metrics
from trunnion.service.basics.server_settings import Settings
from trunnion.service.executor.active_job import ActiveJob
from trunnion.service.executor.chunk_dispatcher import AHEAD, Dispatcher
from trunnion.service.executor.chunk_size import COMMIT_SIZE
from trunnion.service.executor.dask_cluster import NoCluster
from trunnion.service.executor.job_leases import LeasedJobs
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange, digest_of, document_bytes
from trunnion.service.store.database_connection import Unreachable
from trunnion.service.store.leases_and_chunks import WorkStore
from trunnion.service.store.store_records import Job

WORKERS = 130
CASE = 0.5
"""Time of a case, s."""


class Counted(WorkStore):
    """A store that counts its commits of chunks and of ends of jobs."""

    def __init__(self, url: str):
        super().__init__(url)
        self.commits = 0

    def cut_chunks(self, *given: Any, **more: Any) -> Any:
        self.commits += 1
        return super().cut_chunks(*given, **more)

    def record_last_outcomes(self, *given: Any, **more: Any) -> Any:
        self.commits += 1
        return super().record_last_outcomes(*given, **more)

    def end_if_over(self, *given: Any, **more: Any) -> Any:
        self.commits += 1
        return super().end_if_over(*given, **more)


class Workers:
    """A cluster whose workers do nothing. room: number of pieces that it accepts before it disconnects."""

    def __init__(self) -> None:
        self.counted, self.room, self.sent = WORKERS, 10**6, list[tuple[CaseRange, PendingResult]]()

    def slots(self) -> int:
        return self.counted

    def submit_reporting(self, function: Any, url: str, case_range: CaseRange, *_: Any) -> PendingResult:
        if len(self.sent) >= self.room:
            raise NoCluster("it went away")
        n = case_range.stop - case_range.start
        said = {"counts": {"done": n}, "seconds": n * CASE, "build_seconds": 0.0, "bytes": 9}
        self.sent.append((case_range, PendingResult(said)))
        return self.sent[-1][1]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Counted]:
    made = Counted(f"sqlite:///{tmp_path}/jobs.db")
    made.upgrade()
    yield made
    made.close()


@pytest.fixture
def dispatcher(store: Counted, tmp_path: Path) -> Dispatcher:
    """A dispatcher that works on a job whose kernel exists."""
    parts = Parts(f"{tmp_path}/results")
    made = Dispatcher(store, Workers(), parts, Settings(tmp_path), Metrics())  # type: ignore[arg-type]
    store.submit("me", "d", "scene", "", "{}", 100_000, 1e9)
    made._claim()
    held(made).cost, held(made).warm, store.commits = CASE, True, 0
    return made


def held(dispatcher: Dispatcher) -> ActiveJob:
    (active,) = dispatcher.jobs.values()
    return active


def covered(store: Counted, job: Job) -> list[tuple[int, int]]:
    """(start, stop) of all chunks, in any state. Checks that no case is missing and none occurs twice."""
    with store.engine.connect() as c:
        found = c.exec_driver_sql("SELECT start, stop FROM chunks ORDER BY start").all()
    ends = [0, *(stop for _, stop in found)]
    assert [start for start, _ in found] == ends[:-1]
    return [(start, stop) for start, stop in found]


def test_all_workers_are_given_their_fill_and_taken_back_from_in_few_commits(dispatcher: Dispatcher, store: Counted) -> None:
    cluster: Any = dispatcher.cluster
    dispatcher._turn()
    filled = WORKERS * (1 + AHEAD)
    assert len(cluster.sent) == len(held(dispatcher).flying) == filled
    assert store.commits == -(-filled // COMMIT_SIZE)
    store.commits = 0
    for _, later in cluster.sent:
        later.say()
    dispatcher._turn()
    done = store.job(held(dispatcher).job.id)
    assert done is not None
    assert done.done == sum(case_range.stop - case_range.start for case_range, _ in cluster.sent[:filled])
    assert store.commits == 2 * -(-filled // COMMIT_SIZE)
    covered(store, done)


def test_pieces_are_as_large_together_as_one_after_the_other(dispatcher: Dispatcher) -> None:
    active, sizes = held(dispatcher), list[int]()
    together = active.sizes(300, 2.0, WORKERS, dispatcher.dispatch_cost)
    for _ in range(300):
        sizes.append(active.size(2.0, WORKERS, dispatcher.dispatch_cost))
        active.planned += sizes[-1]
    assert together == sizes


def test_where_the_time_of_a_job_is_short_its_pieces_are_cut_one_by_one(dispatcher: Dispatcher) -> None:
    """Each chunk then has its own grant. All grants together never exceed the remaining time."""
    active, cluster = held(dispatcher), dispatcher.cluster
    active.spent = active.job.budget - 1000.0
    assert active.chunks_at_once(100) == 1
    dispatcher._send()
    assert sum(active.granted.values()) <= 1000.0
    assert active.left >= 0.0
    assert len(active.granted) == len(cluster.sent)  # type: ignore[attr-defined]
    active.warm = False
    active.spent = 0.0
    assert active.chunks_at_once(100) == 1, "the first piece builds for all"


def test_pieces_that_no_cluster_takes_wait_and_are_handed_out_when_it_is_back(dispatcher: Dispatcher, store: Counted) -> None:
    cluster: Any = dispatcher.cluster
    cluster.room = 3
    with pytest.raises(NoCluster):
        dispatcher._send()
    job = held(dispatcher).job
    assert [c.start for c in store.running(job.id)] == [p.start for p, _ in cluster.sent]
    cluster.room = 10**6
    held(dispatcher).nothing_until = 0.0
    with store.engine.begin() as c:
        c.exec_driver_sql("UPDATE chunks SET not_before = 0")
    dispatcher._send()
    assert sorted(p.start for p, _ in cluster.sent) == [start for start, _ in covered(store, job)]
    assert {c.attempts for c in store.running(job.id)} == {1}, "pieces that no cluster took count as no attempt"


def test_results_that_arrive_during_a_database_outage_are_recorded_after_it(
    dispatcher: Dispatcher, store: Counted, monkeypatch: pytest.MonkeyPatch
) -> None:
    cluster: Any = dispatcher.cluster
    dispatcher._send()
    for _, later in cluster.sent:
        later.say()

    def away(*given: Any) -> None:
        raise Unreachable("gone")

    with monkeypatch.context() as m:
        m.setattr(store, "record_outcomes", away)
        with pytest.raises(Unreachable):
            dispatcher._record_results()
    assert len(held(dispatcher).flying) == len(cluster.sent)
    dispatcher._record_results()
    done = store.job(held(dispatcher).job.id)
    assert done is not None
    assert done.done == sum(p.stop - p.start for p, _ in cluster.sent)
    assert done.seconds == held(dispatcher).spent == CASE * done.done


def test_a_job_taken_over_is_settled_in_few_commits_as_its_parts_say(store: Counted, tmp_path: Path) -> None:
    """A server was killed after it had sent many chunks, and the parts of some of these chunks exist. These chunks are done, all
    other chunks wait, and no attempt counts."""
    job, _ = store.submit("me", "d", "scene", "", "{}", 5000, 1e9)
    store.claim("killed", 60.0)
    store.begin("killed", job.id)
    pieces = [c for _ in range(5) for c in store.cut_chunks("killed", job.id, [10] * 90)]
    parts, digest = Parts(f"{tmp_path}/results"), digest_of(document_bytes(store.document(job.id)))
    documents = (digest, digest, "x")
    whole, spoilt, others = (CaseRange(job.id, d, c.start, c.stop) for c, d in zip(pieces[100:], documents, strict=False))
    for case_range in (whole, spoilt, others):
        parts.write_part(case_range, pa.table({"case": range(case_range.start, case_range.stop), "outcome": ["done"] * 10}))
    parts.write(parts.part(spoilt), parts.read(parts.part(spoilt))[:-7])
    store.release("killed")
    store.commits = 0
    server = LeasedJobs(store, parts, Settings(tmp_path))
    server._claim()
    assert store.commits == -(-len(pieces) // COMMIT_SIZE)
    assert [(c.start, c.stop) for c in store.finished(job.id)] == [(whole.start, whole.stop)]
    assert store.running(job.id) == []
    again = store.cut_chunks(server.name, job.id, [10] * 449)
    assert [c.start for c in again] == [c.start for c in pieces if c.start != whole.start]
    assert {c.attempts for c in again} == {1}
