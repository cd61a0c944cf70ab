"""The dispatcher: a thread of the server that sends chunks of jobs to the cluster and stores their outcomes.

The dispatcher works on the leased jobs (``job_leases.py``). If the server ends at any moment, no job is damaged."""

from __future__ import annotations

import logging
import queue
import threading
import time
from typing import Any

from trunnion.service.basics.prometheus_metrics import Metrics
from trunnion.service.basics.server_settings import Settings
from trunnion.service.executor.active_job import LEAST_GRANT, LEAST_LEFT, OUT_OF_TIME, WALL_FACTOR, ActiveJob
from trunnion.service.executor.chunk_and_case_runs import Cancelled, OutOfTime, run_chunk
from trunnion.service.executor.chunk_size import COMMIT_SIZE, DispatchCost, check_pause
from trunnion.service.executor.dask_cluster import Cluster, NoCluster
from trunnion.service.executor.job_leases import LeasedJobs
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange, CorruptPart, document_bytes
from trunnion.service.store.database_connection import Unreachable
from trunnion.service.store.leases_and_chunks import ChunkReport, FailedAttempt, LeaseLost, WorkStore
from trunnion.service.store.store_records import Chunk, Job

log = logging.getLogger("trunnion.service")
AHEAD = 1
"""Number of chunks that wait at the cluster for each running chunk. No worker is then idle until the dispatcher's next turn."""
IDLE_SECONDS = 0.05
STOP_SECONDS, RESULT_SECONDS = 2, 10
Report = tuple[ChunkReport | None, FailedAttempt | None]
"""(report of a chunk, None if the report is lost; failed attempt, None if the chunk is done)."""


class Dispatcher(LeasedJobs):
    """The thread that dispatches chunks. trouble: the problem that prevents dispatch, "" for none. dispatch_cost: estimated cost of
    sending and storing chunks."""

    def __init__(self, store: WorkStore, cluster: Cluster, parts: Parts, settings: Settings, metrics: Metrics):
        super().__init__(store, parts, settings)
        self.cluster, self.metrics, self.dispatch_cost = cluster, metrics, DispatchCost()
        self.thread = threading.Thread(target=self._run, name="dispatcher", daemon=True)
        self.woken, self.stopping = threading.Event(), threading.Event()
        self.trouble = ""

    def start(self) -> None:
        self.thread.start()

    def stop(self) -> None:
        """Stop the thread and release its leases, so that another server can continue the jobs at once."""
        self.stopping.set()
        self.woken.set()
        self.thread.join(STOP_SECONDS)

    def start_job(self, job: Job, document: str) -> None:
        """Start a new job in the next turn. document: the text of the stored request."""
        self.submitted.put((job, document))
        self.woken.set()

    def wake(self) -> None:
        """Start the next turn now, because a job was cancelled."""
        self.claimed = -1e9
        self.woken.set()

    def _run(self) -> None:
        while not self.stopping.is_set():
            try:
                busy = self._turn()
                self.trouble = ""
            except (Unreachable, NoCluster, OSError) as e:
                if not isinstance(e, NoCluster):
                    self._mark_uncertain()
                text = str(e) or type(e).__name__
                if text != self.trouble:
                    log.warning("dispatcher: %s", text)
                self.trouble = text
                self.stopping.wait(0.5)
                busy = False
            except Exception:
                log.exception("dispatcher")
                self._mark_uncertain()
                self.trouble = "internal error, see the log"
                self.stopping.wait(1.0)
                busy = False
            self.woken.wait(IDLE_SECONDS if busy or self.jobs else 0.5)
            self.woken.clear()
        try:
            self.store.release(self.name)
        except Unreachable as e:
            log.warning("leases not released: %s", e)

    # -- one turn -----------------------------------------------------------------------------------------------------------

    def _turn(self) -> bool:
        """Do one turn: store results, renew leases, send chunks. Returns whether there was work."""
        busy = self._record_results()
        if time.monotonic() - self.claimed > self.settings.lease / 3:
            self._claim()
        self._start_submitted()
        for active in list(self.jobs.values()):
            try:
                self._check_job(active)
            except LeaseLost:
                self._forget(active)
        self.cluster.slots()
        return self._send() or busy

    # -- sending ------------------------------------------------------------------------------------------------------------

    def _send(self) -> bool:
        """Send chunks of all jobs in turn until the cluster is full. The first chunk of a job runs alone, because this chunk builds
        the kernel that the other chunks share. Returns whether any chunk was sent."""
        if not self.jobs:
            return False
        room = self.cluster.slots() * (1 + AHEAD) - sum(len(a.flying) for a in self.jobs.values())
        some, turn = False, list(self.jobs.values())
        while room > 0 and turn:
            share = max(1, room // len(turn))
            for active in list(turn):
                if room <= 0:
                    break
                sent = 0 if active.flying and not active.warm else self._send_some(active, min(share, room))
                if not sent:
                    turn.remove(active)
                    continue
                some, room = True, room - sent
        return some

    def _send_some(self, active: ActiveJob, most: int) -> int:
        """Cut the next chunks of a job, at most ``most``, in one database transaction, and send these chunks. Returns the number of
        sent chunks."""
        if time.monotonic() < active.nothing_until:
            return 0
        if active.left < (LEAST_GRANT if active.flying else LEAST_LEFT):
            if not active.flying:
                self._stop_job(active, "failed", [OUT_OF_TIME])
            return 0
        slots = max(1, self.cluster.counted)
        longest = self.dispatch_cost.longest(self.settings.chunk_seconds, slots, active.chunks_at_once(slots))
        began = time.perf_counter()
        sizes = active.sizes(active.chunks_at_once(most), longest, slots, self.dispatch_cost)
        try:
            chunks = self.store.cut_chunks(self.name, active.job.id, sizes, self._delay(self.settings.attempts) + 1.0)
        except LeaseLost:
            self._forget(active)
            return 0
        if not chunks:
            active.nothing_until = time.monotonic() + 0.3
            return 0
        active.planned = max(active.planned, *(chunk.stop for chunk in chunks))
        early = [chunk for chunk in chunks if chunk.stop > active.known]
        if early:  # the server has taken over the study, but has not read the results of its earlier rounds
            self._give_back(early, "not known yet")
        todo = [chunk for chunk in chunks if chunk.stop <= active.known]
        for k, chunk in enumerate(todo):
            try:
                self._submit(active, chunk, active.time_grant(chunk, longest, slots), check_pause(slots))
            except NoCluster:
                self._give_back(todo[k:], "no cluster")
                raise
        self.dispatch_cost.record(len(chunks), time.perf_counter() - began)
        return len(todo)

    def _submit(self, active: ActiveJob, chunk: Chunk, time_grant: tuple[float, float], pause: float) -> None:
        case_range = CaseRange(chunk.job, active.document, chunk.start, chunk.stop)
        values = None if active.follow is None else active.follow.rows(chunk.start, chunk.stop).tolist()
        future = self.cluster.submit_reporting(run_chunk, self.parts.url, case_range, *time_grant, values, pause)
        active.flying[chunk.start], active.granted[chunk.start] = (chunk, future), time_grant[0]
        future.add_done_callback(lambda f, job=chunk.job, start=chunk.start: self._put_returned(job, start, f))

    def _give_back(self, chunks: list[Chunk], why: str) -> None:
        """Set chunks back to waiting, because they cannot be sent now."""
        self.store.record_outcomes(
            self.name, chunks[0].job, {}, {c.start: FailedAttempt(why, 0.5, False) for c in chunks}, self.settings.attempts
        )

    def _put_returned(self, job: str, start: int, future: Any) -> None:
        self.returned.put((job, start, future))
        self.woken.set()

    # -- returned chunks ----------------------------------------------------------------------------------------------------

    def _record_results(self) -> bool:
        """Store all chunks that returned from the cluster. Returns whether any chunk was stored."""
        waiting = self._returned_futures()
        some = bool(waiting)
        while waiting:
            job, futures = next(iter(waiting.items()))
            active = self.jobs[job]
            try:
                self._renew()
                self._record_returned(active, futures)
            except LeaseLost:
                self._forget(active)
            except Exception:
                for job, futures in waiting.items():  # the parts exist already; a later turn stores their outcomes
                    for start, future in futures.items():
                        self.returned.put((job, start, future))
                raise
            waiting.pop(job)
            waiting = waiting or self._returned_futures()
        return some

    def _returned_futures(self) -> dict[str, dict[int, Any]]:
        """The next returned futures by job and first case. Futures of chunks that ``flying`` lacks are dropped."""
        found: dict[str, dict[int, Any]] = {}
        for _ in range(COMMIT_SIZE):
            try:
                job, start, future = self.returned.get_nowait()
            except queue.Empty:
                break
            active = self.jobs.get(job)
            if active is not None and start in active.flying and active.flying[start][1] is future:
                found.setdefault(job, {})[start] = future
        return found

    def _record_returned(self, active: ActiveJob, futures: dict[int, Any]) -> None:
        """Store the chunks of a job that returned with a result or an error."""
        began, reports = time.perf_counter(), dict[int, Report]()
        for start, future in futures.items():
            self._renew()
            reports[start] = self._report(active, start, future)
        lost = {start: gone for start, (_, gone) in reports.items() if gone is not None}
        done = {start: d for start, (d, gone) in reports.items() if d is not None and gone is None}
        end: str | None = None
        outcomes = (self.name, active.job.id, done, lost, self.settings.attempts)
        if active.follow is None and active.planned >= active.known and len(reports) == len(active.flying):
            states, end = self.store.record_last_outcomes(*outcomes)
        else:
            states = self.store.record_outcomes(*outcomes)
        for start, (used, _) in reports.items():
            self._learn_cost(active, start, used)
            chunk = active.flying.pop(start)[0]
            if start in lost:
                self.metrics.chunks.labels(states[start]).inc()
                told = (chunk.job, start, chunk.stop - 1, lost[start].error, states[start])
                log.warning("job %s, cases %d to %d: %s (%s)", *told)
        self.dispatch_cost.record(len(reports), time.perf_counter() - began)
        if end is not None:
            self._forget(active)
        elif active.follow is not None and active.planned >= active.known and not active.flying:
            self._end_if_over(active)

    def _report(self, active: ActiveJob, start: int, future: Any) -> Report:
        """The report of one returned chunk."""
        chunk, granted = active.flying[start][0], active.granted.get(start, 0.0)
        got = self._result(future) if future.status == "finished" else None
        if future.status == "error" and isinstance(future.exception(), OutOfTime):
            got = {"counts": {}, "seconds": 0.0, "build_seconds": granted, "bytes": 0, "reached": start}
        if got is None:
            return None, self._lost(chunk, future)
        done = ChunkReport(**got)
        if not sum(done.counts.values()) and chunk.stop - chunk.start == 1 and granted >= WALL_FACTOR * active.cpu_limit:
            what = f"the case did not end within {granted:.3g} s, far beyond its CPU-time limit: the machine may be overloaded"
            return done, FailedAttempt(what, self.settings.retry_delay)
        return done, None

    def _learn_cost(self, active: ActiveJob, start: int, used: ChunkReport | None) -> None:
        """Update the used time of a job and the computing time of a case (``cost``) from the report of a stored chunk."""
        active.release_grant(start, used.seconds + used.build_seconds if used else 0.0)
        if used is None:
            return
        n = sum(used.counts.values())
        self.metrics.chunk(n, used.seconds)
        if used.seconds > 0.0:
            now = used.seconds / max(n, 1)
            active.cost = now if not active.cost else 0.7 * active.cost + 0.3 * now
            active.warm = True  # the kernel now exists

    @staticmethod
    def _result(future: Any) -> dict[str, Any] | None:
        """The report that a worker returned. A report that did not come with the end of the task is requested. None if the report
        is lost. The next attempt then finds the part if the worker wrote it."""
        try:
            return dict(getattr(future, "report", None) or future.result(timeout=RESULT_SECONDS))
        except Exception as e:  # noqa: BLE001  # after any error, the chunk runs again
            log.info("a result was lost: %s", e)
            return None

    def _lost(self, chunk: Chunk, future: Any) -> FailedAttempt:
        """The record of a failed attempt. The cause is either the chunk (an error, or a worker that was killed repeatedly) or the
        cluster. Only a failure that the chunk caused counts towards the limit of attempts."""
        failed = future.status == "error"
        error = future.exception() if failed else None
        blame = failed and not isinstance(error, Cancelled)
        if isinstance(error, CorruptPart):
            self.parts.write(self.parts.job_file(chunk.job), document_bytes(self.store.document(chunk.job)))
        text = f"{type(error).__name__}: {error}" if failed else "the cluster was lost"
        return FailedAttempt(text, self._delay(chunk.attempts) if blame else 0.5, blame)

    def _delay(self, attempts: int) -> float:
        """The pause before the next attempt, s. attempts: number of attempts that were made."""
        return self.settings.retry_delay * 2.0 ** max(0, attempts - 1)
