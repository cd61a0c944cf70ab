"""Hands chunks of jobs to the cluster and writes down what became of them: one thread beside the server.

It works on the jobs this server holds (``held.py``): what it keeps in memory can be lost at any moment.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from typing import Any

from service.executor.active import LEAST_GRANT, LEAST_LEFT, OUT_OF_TIME, WALL, Active
from service.executor.cluster import Cluster, NoCluster
from service.executor.held import HeldJobs
from service.executor.parts import Parts
from service.executor.sealed import Piece, Spoiled, document_bytes
from service.executor.sizing import Handing, look_pause
from service.executor.work import Cancelled, OutOfTime, run_chunk
from service.metrics import Metrics
from service.settings import Settings
from service.store.database import Unreachable
from service.store.rows import Chunk
from service.store.work import Done, LeaseLost, WorkStore

log = logging.getLogger("trunnion.service")
AHEAD = 1
"""How many chunks wait at the cluster for each that runs, so that no worker is idle until the next turn."""
IDLE_SECONDS = 0.05
RESULT_SECONDS = 10
STOP_SECONDS = 2


class Dispatcher(HeldJobs):
    """The thread that hands out chunks. trouble: what keeps it from working now, in words ("" when nothing does)."""

    def __init__(self, store: WorkStore, cluster: Cluster, parts: Parts, settings: Settings, metrics: Metrics):
        super().__init__(store, parts, settings)
        self.cluster, self.metrics = cluster, metrics
        self.thread = threading.Thread(target=self._run, name="dispatcher", daemon=True)
        self.woken, self.stopping = threading.Event(), threading.Event()
        self.trouble = ""
        self.handing, self.moved = Handing(), 0

    def start(self) -> None:
        """Start the thread."""
        self.thread.start()

    def stop(self) -> None:
        """Stop the thread and give back its leases, so that another server can go on at once."""
        self.stopping.set()
        self.woken.set()
        self.thread.join(STOP_SECONDS)

    def wake(self) -> None:
        """Work on now instead of at the next turn: a job was submitted or is to be cancelled."""
        self.claimed = -1e9
        self.woken.set()

    def _run(self) -> None:
        while not self.stopping.is_set():
            try:
                busy = self._turn()
                self.trouble = ""
            except (Unreachable, NoCluster, OSError) as e:
                if not isinstance(e, NoCluster):
                    self._doubt()
                self._in_trouble(e)
                busy = False
            except Exception:
                log.exception("dispatcher")
                self._doubt()
                self.trouble = "internal error, see the log"
                self.stopping.wait(1.0)
                busy = False
            self.woken.wait(IDLE_SECONDS if busy or self.jobs else 0.5)
            self.woken.clear()
        try:
            self.store.release(self.name)
        except Unreachable as e:
            log.warning("leases not given back: %s", e)

    def _in_trouble(self, e: Exception) -> None:
        text = str(e) or type(e).__name__
        if text != self.trouble:
            log.warning("cannot work: %s", text)
        self.trouble = text
        self.stopping.wait(0.5)

    # -- one turn -----------------------------------------------------------------------------------------------------------

    def _turn(self) -> bool:
        """One turn: take results that came back, renew leases, send off more chunks. True when something was done."""
        began, self.moved = time.perf_counter(), 0
        busy = self._take_landed()
        if time.monotonic() - self.claimed > self.settings.lease / 3:
            self._claim()
        for active in list(self.jobs.values()):
            try:
                self._look_after(active)
            except LeaseLost:
                self._forget(active)
        self.cluster.slots()
        busy = self._send() or busy
        self.handing.turned(self.moved, time.perf_counter() - began)
        return busy

    # -- landing ------------------------------------------------------------------------------------------------------------

    def _take_landed(self) -> bool:
        """Record everything that has come back from the cluster."""
        some = False
        while True:
            try:
                job, start, future = self.landed.get_nowait()
            except queue.Empty:
                return some
            some = True
            active = self.jobs.get(job)
            if active is None or start not in active.flying or active.flying[start][1] is not future:
                continue
            try:
                self._renew()
                self._landed(active, start, future)
            except LeaseLost:
                self._forget(active)
            except Exception:
                self.landed.put((job, start, future))  # the part is safe; say so when the database is back
                raise

    def _landed(self, active: Active, start: int, future: Any) -> None:
        """Record one chunk that came back with a result or an error."""
        chunk = active.flying[start][0]
        got = self._result(future) if future.status == "finished" else None
        granted = active.granted.get(start, 0.0)
        if future.status == "error" and isinstance(future.exception(), OutOfTime):
            got = {"counts": {}, "seconds": 0.0, "build_seconds": granted, "bytes": 0, "reached": start}
        if got is not None:
            self._recorded(active, chunk, granted, Done(**got))
        else:
            active.landed(start, 0.0)
            self._lost(chunk, future)
        active.flying.pop(start, None)
        self.moved += 1
        if active.planned >= active.known and not active.flying:
            self._end_if_over(active)

    def _recorded(self, active: Active, chunk: Chunk, granted: float, done: Done) -> None:
        """Record what a chunk reports, and learn from it what a case costs."""
        n = sum(done.counts.values())
        if not n and chunk.stop - chunk.start == 1 and granted >= WALL * active.patience:
            what = f"the case was not over after {granted:.3g} s, far beyond its patience: is the machine stopped, or overloaded?"
            self.store.chunk_lost(self.name, chunk.job, chunk.start, what, self.settings.attempts, self.settings.retry_delay)
        else:
            self.store.chunk_done(self.name, chunk.job, chunk.start, done)
        active.landed(chunk.start, done.seconds + done.build_seconds)
        self.metrics.chunk(n, done.seconds)
        if done.seconds > 0.0:
            now = done.seconds / max(n, 1)
            active.cost = now if not active.cost else 0.7 * active.cost + 0.3 * now
        active.warm = active.warm or done.seconds > 0.0  # the kernel is there

    @staticmethod
    def _result(future: Any) -> dict[str, Any] | None:
        """What the chunk reports; None when the report is lost (its part may be there, and the next attempt will find it)."""
        try:
            return dict(future.result(timeout=RESULT_SECONDS))
        except Exception as e:  # noqa: BLE001  # whatever became of the worker, the chunk is simply asked for again
            log.info("a result went missing: %s", e)
            return None

    def _lost(self, chunk: Chunk, future: Any) -> None:
        """An attempt came to nothing: by its own fault (an error, a worker killed again and again) or the cluster's."""
        failed = future.status == "error"
        error = future.exception() if failed else None
        blame = failed and not isinstance(error, Cancelled)
        if isinstance(error, Spoiled):
            self.parts.write(self.parts.job_file(chunk.job), document_bytes(self.store.document(chunk.job)))
        text = f"{type(error).__name__}: {error}" if failed else "the cluster went away"
        delay = self._delay(chunk.attempts) if blame else 0.5
        state = self.store.chunk_lost(self.name, chunk.job, chunk.start, text, self.settings.attempts, delay, blame)
        self.metrics.chunk_lost(state)
        log.warning("job %s, cases %d to %d: %s (%s)", chunk.job, chunk.start, chunk.stop - 1, text, state)

    def _delay(self, attempts: int) -> float:
        """Seconds after which a chunk is tried again that was tried so many times."""
        return self.settings.retry_delay * 2.0 ** max(0, attempts - 1)

    # -- sending ------------------------------------------------------------------------------------------------------------

    def _send(self) -> bool:
        """Fill the cluster, jobs taking turns. A job's first chunk goes alone: it builds the kernel that all share."""
        if not self.jobs:
            return False
        room = self.cluster.slots() * (1 + AHEAD) - sum(len(a.flying) for a in self.jobs.values())
        some, turn = False, list(self.jobs.values())
        while room > 0 and turn:
            for active in list(turn):
                if room <= 0:
                    break
                if (active.flying and not active.warm) or not self._send_one(active):
                    turn.remove(active)
                    continue
                some, room = True, room - 1
        return some

    def _send_one(self, active: Active) -> bool:
        """Send one chunk of a job; False when it has none to send now."""
        if time.monotonic() < active.nothing_until:
            return False
        if active.left < (LEAST_GRANT if active.flying else LEAST_LEFT):
            if not active.flying:
                self._stop_job(active, "failed", [OUT_OF_TIME])
            return False
        slots = max(1, self.cluster.counted)
        longest = self.handing.longest(self.settings.chunk_seconds, slots)
        size = active.size(longest, slots, self.handing)
        try:
            chunk = self.store.cut(self.name, active.job.id, size, self._delay(self.settings.attempts) + 1.0)
        except LeaseLost:
            self._forget(active)
            return False
        if chunk is None:
            active.nothing_until = time.monotonic() + 0.3
            return False
        active.planned = max(active.planned, chunk.stop)
        if chunk.stop > active.known:  # of a study that was taken over, before its earlier results are there again
            self.store.chunk_lost(self.name, chunk.job, chunk.start, "not known yet", self.settings.attempts, 0.5, blame=False)
            return False
        grant = active.grant(chunk, longest, slots)
        try:
            piece = Piece(chunk.job, active.document, chunk.start, chunk.stop)
            values = None if active.follow is None else active.follow.rows(chunk.start, chunk.stop).tolist()
            future = self.cluster.submit(run_chunk, self.parts.url, piece, *grant, values, look_pause(slots))
        except NoCluster:
            self.store.chunk_lost(self.name, chunk.job, chunk.start, "no cluster", self.settings.attempts, 0.5, blame=False)
            raise
        active.flying[chunk.start], active.granted[chunk.start] = (chunk, future), grant[0]
        self.moved += 1
        future.add_done_callback(lambda f, job=chunk.job, start=chunk.start: self._came(job, start, f))
        return True

    def _came(self, job: str, start: int, future: Any) -> None:
        self.landed.put((job, start, future))
        self.woken.set()
