"""What comes back from the cluster: recorded, many pieces of a job in one commit, and learnt from."""

from __future__ import annotations

import logging
import queue
import time
from typing import Any

from service.executor.active import WALL, Active
from service.executor.held import HeldJobs
from service.executor.parts import Parts
from service.executor.sealed import Spoiled, document_bytes
from service.executor.sizing import TOGETHER, Handing
from service.executor.work import Cancelled, OutOfTime
from service.metrics import Metrics
from service.settings import Settings
from service.store.rows import Chunk
from service.store.work import Done, LeaseLost, Lost, WorkStore

log = logging.getLogger("trunnion.service")
RESULT_SECONDS = 10
Report = tuple[Done | None, Lost | None]
"""What a piece has used and has done, where that is known, and what became of it when it was not done."""


class Landings(HeldJobs):
    """The jobs that are held, and what lands of them. handing: what it costs to hand pieces out and to take them back."""

    def __init__(self, store: WorkStore, parts: Parts, settings: Settings, metrics: Metrics):
        super().__init__(store, parts, settings)
        self.metrics, self.handing = metrics, Handing()

    def _take_landed(self) -> bool:
        """Record everything that has come back from the cluster."""
        waiting = self._came_back()
        some = bool(waiting)
        while waiting:
            job, futures = next(iter(waiting.items()))
            active = self.jobs[job]
            try:
                self._renew()
                self._landed(active, futures)
            except LeaseLost:
                self._forget(active)
            except Exception:
                for job, futures in waiting.items():  # the parts are safe; say so when the database is back
                    for start, future in futures.items():
                        self.landed.put((job, start, future))
                raise
            waiting.pop(job)
            waiting = waiting or self._came_back()
        return some

    def _came_back(self) -> dict[str, dict[int, Any]]:
        """The next futures that have come back, by their jobs and first cases; not those that nobody waits for any more."""
        found: dict[str, dict[int, Any]] = {}
        for _ in range(TOGETHER):
            try:
                job, start, future = self.landed.get_nowait()
            except queue.Empty:
                break
            active = self.jobs.get(job)
            if active is not None and start in active.flying and active.flying[start][1] is future:
                found.setdefault(job, {})[start] = future
        return found

    def _landed(self, active: Active, futures: dict[int, Any]) -> None:
        """Record chunks of a job that came back with a result or an error."""
        began, reports = time.perf_counter(), dict[int, Report]()
        for start, future in futures.items():
            self._renew()
            reports[start] = self._report(active, start, future)
        lost = {start: gone for start, (_, gone) in reports.items() if gone is not None}
        done = {start: d for start, (d, gone) in reports.items() if d is not None and gone is None}
        states = self.store.settle(self.name, active.job.id, done, lost, self.settings.attempts)
        for start, (used, _) in reports.items():
            self._learn(active, start, used)
            chunk = active.flying.pop(start)[0]
            if start in lost:
                self.metrics.chunk_lost(states[start])
                told = (chunk.job, start, chunk.stop - 1, lost[start].error, states[start])
                log.warning("job %s, cases %d to %d: %s (%s)", *told)
        self.handing.took(len(reports), time.perf_counter() - began)
        if active.planned >= active.known and not active.flying:
            self._end_if_over(active)

    def _report(self, active: Active, start: int, future: Any) -> Report:
        """What has become of one chunk."""
        chunk, granted = active.flying[start][0], active.granted.get(start, 0.0)
        got = self._result(future) if future.status == "finished" else None
        if future.status == "error" and isinstance(future.exception(), OutOfTime):
            got = {"counts": {}, "seconds": 0.0, "build_seconds": granted, "bytes": 0, "reached": start}
        if got is None:
            return None, self._lost(chunk, future)
        done = Done(**got)
        if not sum(done.counts.values()) and chunk.stop - chunk.start == 1 and granted >= WALL * active.patience:
            what = f"the case was not over after {granted:.3g} s, far beyond its patience: is the machine stopped, or overloaded?"
            return done, Lost(what, self.settings.retry_delay)
        return done, None

    def _learn(self, active: Active, start: int, used: Done | None) -> None:
        """Learn from a chunk that was recorded what it has used, and what a case costs."""
        active.landed(start, used.seconds + used.build_seconds if used else 0.0)
        if used is None:
            return
        n = sum(used.counts.values())
        self.metrics.chunk(n, used.seconds)
        if used.seconds > 0.0:
            now = used.seconds / max(n, 1)
            active.cost = now if not active.cost else 0.7 * active.cost + 0.3 * now
            active.warm = True  # the kernel is there

    @staticmethod
    def _result(future: Any) -> dict[str, Any] | None:
        """What the chunk reports; None when the report is lost (its part may be there, and the next attempt will find it)."""
        try:
            return dict(future.result(timeout=RESULT_SECONDS))
        except Exception as e:  # noqa: BLE001  # whatever became of the worker, the chunk is simply asked for again
            log.info("a result went missing: %s", e)
            return None

    def _lost(self, chunk: Chunk, future: Any) -> Lost:
        """An attempt came to nothing: by its own fault (an error, a worker killed again and again) or the cluster's."""
        failed = future.status == "error"
        error = future.exception() if failed else None
        blame = failed and not isinstance(error, Cancelled)
        if isinstance(error, Spoiled):
            self.parts.write(self.parts.job_file(chunk.job), document_bytes(self.store.document(chunk.job)))
        text = f"{type(error).__name__}: {error}" if failed else "the cluster went away"
        return Lost(text, self._delay(chunk.attempts) if blame else 0.5, blame)

    def _delay(self, attempts: int) -> float:
        """Seconds after which a chunk is tried again that was tried so many times."""
        return self.settings.retry_delay * 2.0 ** max(0, attempts - 1)
