"""The dispatcher: a thread of the server that sends chunks of jobs to the cluster and stores their outcomes.

It works on the leased jobs (``job_leases.py``). Its data in memory can be lost at any moment without damage."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

from trunnion.service.basics.prometheus_metrics import Metrics
from trunnion.service.basics.server_settings import Settings
from trunnion.service.executor.active_job import LEAST_GRANT, LEAST_LEFT, OUT_OF_TIME, Active
from trunnion.service.executor.chunk_and_case_runs import run_chunk
from trunnion.service.executor.chunk_ingestion import ChunkIngestion
from trunnion.service.executor.chunk_size import check_pause
from trunnion.service.executor.dask_cluster import Cluster, NoCluster
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_checksum import Piece
from trunnion.service.store.chunk_outcomes import LeaseLost, Lost
from trunnion.service.store.database_connection import Unreachable
from trunnion.service.store.job_and_chunk_records import Chunk
from trunnion.service.store.leases_and_chunks import WorkStore

log = logging.getLogger("trunnion.service")
AHEAD = 1
"""For each running chunk, this many chunks wait at the cluster, so that no worker is idle until the next turn."""
IDLE_SECONDS = 0.05
STOP_SECONDS = 2


class Dispatcher(ChunkIngestion):
    """The thread that dispatches chunks. trouble: the problem that prevents dispatch, "" for none."""

    def __init__(self, store: WorkStore, cluster: Cluster, parts: Parts, settings: Settings, metrics: Metrics):
        super().__init__(store, parts, settings, metrics)
        self.cluster = cluster
        self.thread = threading.Thread(target=self._run, name="dispatcher", daemon=True)
        self.woken, self.stopping = threading.Event(), threading.Event()
        self.trouble = ""

    def start(self) -> None:
        self.thread.start()

    def stop(self) -> None:
        """Stop the thread and release its leases, so that another server can continue at once."""
        self.stopping.set()
        self.woken.set()
        self.thread.join(STOP_SECONDS)

    def wake(self) -> None:
        """Start the next turn now, because a job was submitted or cancelled."""
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
        for active in list(self.jobs.values()):
            try:
                self._check_job(active)
            except LeaseLost:
                self._forget(active)
        self.cluster.slots()
        return self._send() or busy

    # -- sending ------------------------------------------------------------------------------------------------------------

    def _send(self) -> bool:
        """Send chunks of all jobs in turn until the cluster is full. The first chunk of a job runs alone, because it builds the
        kernel that the other chunks share. Returns whether any chunk was sent."""
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

    def _send_some(self, active: Active, most: int) -> int:
        """Cut the next chunks of a job, at most ``most``, in one commit, and send them. Returns the number of sent chunks."""
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
        if early:  # this server took the study over, and has not yet read the study's earlier results
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

    def _submit(self, active: Active, chunk: Chunk, time_grant: tuple[float, float], pause: float) -> None:
        piece = Piece(chunk.job, active.document, chunk.start, chunk.stop)
        values = None if active.follow is None else active.follow.rows(chunk.start, chunk.stop).tolist()
        future = self.cluster.submit(run_chunk, self.parts.url, piece, *time_grant, values, pause)
        active.flying[chunk.start], active.granted[chunk.start] = (chunk, future), time_grant[0]
        future.add_done_callback(lambda f, job=chunk.job, start=chunk.start: self._stop_timer(job, start, f))

    def _give_back(self, chunks: list[Chunk], why: str) -> None:
        """Set chunks back to waiting, because they cannot be sent now."""
        self.store.record_outcomes(
            self.name, chunks[0].job, {}, {c.start: Lost(why, 0.5, False) for c in chunks}, self.settings.attempts
        )

    def _stop_timer(self, job: str, start: int, future: Any) -> None:
        self.returned.put((job, start, future))
        self.woken.set()
