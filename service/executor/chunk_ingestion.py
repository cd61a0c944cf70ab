"""Ingestion of chunks that returned from the cluster. One commit stores many chunks of a job."""

from __future__ import annotations

import logging
import queue
import time
from typing import Any

from trunnion.service.basics.prometheus_metrics import Metrics
from trunnion.service.basics.server_settings import Settings
from trunnion.service.executor.active_job import WALL_FACTOR, Active
from trunnion.service.executor.chunk_and_case_runs import Cancelled, OutOfTime
from trunnion.service.executor.chunk_size import COMMIT_SIZE, DispatchCost
from trunnion.service.executor.job_leases import LeasedJobs
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_checksum import CorruptPart, document_bytes
from trunnion.service.store.chunk_outcomes import Done, LeaseLost, Lost
from trunnion.service.store.job_and_chunk_records import Chunk
from trunnion.service.store.leases_and_chunks import WorkStore

log = logging.getLogger("trunnion.service")
RESULT_SECONDS = 10
Report = tuple[Done | None, Lost | None]
"""The report of a chunk (None if it is lost), and the failed attempt (None if the chunk is done)."""


class ChunkIngestion(LeasedJobs):
    """The leased jobs, with the ingestion of their returned chunks. dispatch_cost: estimated cost of sending and storing chunks."""

    def __init__(self, store: WorkStore, parts: Parts, settings: Settings, metrics: Metrics):
        super().__init__(store, parts, settings)
        self.metrics, self.dispatch_cost = metrics, DispatchCost()

    def _record_results(self) -> bool:
        """Store all chunks that returned from the cluster. Returns whether there were any."""
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
        """The next returned futures by job and first case. Futures of chunks that are no longer in ``flying`` are dropped."""
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

    def _record_returned(self, active: Active, futures: dict[int, Any]) -> None:
        """Store the chunks of a job that returned with a result or an error."""
        began, reports = time.perf_counter(), dict[int, Report]()
        for start, future in futures.items():
            self._renew()
            reports[start] = self._report(active, start, future)
        lost = {start: gone for start, (_, gone) in reports.items() if gone is not None}
        done = {start: d for start, (d, gone) in reports.items() if d is not None and gone is None}
        states = self.store.record_outcomes(self.name, active.job.id, done, lost, self.settings.attempts)
        for start, (used, _) in reports.items():
            self._learn_cost(active, start, used)
            chunk = active.flying.pop(start)[0]
            if start in lost:
                self.metrics.chunks.labels(states[start]).inc()
                told = (chunk.job, start, chunk.stop - 1, lost[start].error, states[start])
                log.warning("job %s, cases %d to %d: %s (%s)", *told)
        self.dispatch_cost.record(len(reports), time.perf_counter() - began)
        if active.planned >= active.known and not active.flying:
            self._end_if_over(active)

    def _report(self, active: Active, start: int, future: Any) -> Report:
        """The report of one returned chunk."""
        chunk, granted = active.flying[start][0], active.granted.get(start, 0.0)
        got = self._result(future) if future.status == "finished" else None
        if future.status == "error" and isinstance(future.exception(), OutOfTime):
            got = {"counts": {}, "seconds": 0.0, "build_seconds": granted, "bytes": 0, "reached": start}
        if got is None:
            return None, self._lost(chunk, future)
        done = Done(**got)
        if not sum(done.counts.values()) and chunk.stop - chunk.start == 1 and granted >= WALL_FACTOR * active.cpu_limit:
            what = f"the case had not ended after {granted:.3g} s, far beyond its CPU-time limit: the machine may be overloaded"
            return done, Lost(what, self.settings.retry_delay)
        return done, None

    def _learn_cost(self, active: Active, start: int, used: Done | None) -> None:
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
        """The report that a worker returned; None if the report is lost. The next attempt then finds the part, if it was
        written."""
        try:
            return dict(future.result(timeout=RESULT_SECONDS))
        except Exception as e:  # noqa: BLE001  # after any error, the chunk is requested again
            log.info("a result was lost: %s", e)
            return None

    def _lost(self, chunk: Chunk, future: Any) -> Lost:
        """The record of a failed attempt. The cause is either the chunk (an error, or a worker that was killed repeatedly) or the
        cluster. Only a failure that the chunk caused counts towards the limit of attempts."""
        failed = future.status == "error"
        error = future.exception() if failed else None
        blame = failed and not isinstance(error, Cancelled)
        if isinstance(error, CorruptPart):
            self.parts.write(self.parts.job_file(chunk.job), document_bytes(self.store.document(chunk.job)))
        text = f"{type(error).__name__}: {error}" if failed else "the cluster was lost"
        return Lost(text, self._delay(chunk.attempts) if blame else 0.5, blame)

    def _delay(self, attempts: int) -> float:
        """The pause before the next attempt, s. attempts: number of attempts that were made."""
        return self.settings.retry_delay * 2.0 ** max(0, attempts - 1)
