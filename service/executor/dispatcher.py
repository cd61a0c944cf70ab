"""Hands chunks of jobs to the cluster and writes down what became of them: one thread beside the server.

It works on the jobs this server holds (``held.py``): what it keeps in memory can be lost at any moment.
"""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

from service.executor.active import LEAST_GRANT, LEAST_LEFT, OUT_OF_TIME, Active
from service.executor.cluster import Cluster, NoCluster
from service.executor.landed import Landings
from service.executor.parts import Parts
from service.executor.sealed import Piece
from service.executor.sizing import look_pause
from service.executor.work import run_chunk
from service.metrics import Metrics
from service.settings import Settings
from service.store.database import Unreachable
from service.store.rows import Chunk
from service.store.work import LeaseLost, Lost, WorkStore

log = logging.getLogger("trunnion.service")
AHEAD = 1
"""How many chunks wait at the cluster for each that runs, so that no worker is idle until the next turn."""
IDLE_SECONDS = 0.05
STOP_SECONDS = 2


class Dispatcher(Landings):
    """The thread that hands out chunks. trouble: what keeps it from working now, in words ("" when nothing does)."""

    def __init__(self, store: WorkStore, cluster: Cluster, parts: Parts, settings: Settings, metrics: Metrics):
        super().__init__(store, parts, settings, metrics)
        self.cluster = cluster
        self.thread = threading.Thread(target=self._run, name="dispatcher", daemon=True)
        self.woken, self.stopping = threading.Event(), threading.Event()
        self.trouble = ""

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
        busy = self._take_landed()
        if time.monotonic() - self.claimed > self.settings.lease / 3:
            self._claim()
        for active in list(self.jobs.values()):
            try:
                self._look_after(active)
            except LeaseLost:
                self._forget(active)
        self.cluster.slots()
        return self._send() or busy

    # -- sending ------------------------------------------------------------------------------------------------------------

    def _send(self) -> bool:
        """Fill the cluster, jobs taking turns. A job's first chunk goes alone: it builds the kernel that all share."""
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
        """Send the next chunks of a job, at most so many, cut in one commit; how many it were: 0 when it has none to send now."""
        if time.monotonic() < active.nothing_until:
            return 0
        if active.left < (LEAST_GRANT if active.flying else LEAST_LEFT):
            if not active.flying:
                self._stop_job(active, "failed", [OUT_OF_TIME])
            return 0
        slots = max(1, self.cluster.counted)
        longest = self.handing.longest(self.settings.chunk_seconds, slots, active.together(slots))
        began = time.perf_counter()
        sizes = active.sizes(active.together(most), longest, slots, self.handing)
        try:
            chunks = self.store.cuts(self.name, active.job.id, sizes, self._delay(self.settings.attempts) + 1.0)
        except LeaseLost:
            self._forget(active)
            return 0
        if not chunks:
            active.nothing_until = time.monotonic() + 0.3
            return 0
        active.planned = max(active.planned, *(chunk.stop for chunk in chunks))
        early = [chunk for chunk in chunks if chunk.stop > active.known]
        if early:  # of a study that was taken over, before its earlier results are there again
            self._give_back(early, "not known yet")
        todo = [chunk for chunk in chunks if chunk.stop <= active.known]
        for k, chunk in enumerate(todo):
            try:
                self._submit(active, chunk, active.grant(chunk, longest, slots), look_pause(slots))
            except NoCluster:
                self._give_back(todo[k:], "no cluster")
                raise
        self.handing.took(len(chunks), time.perf_counter() - began)
        return len(todo)

    def _submit(self, active: Active, chunk: Chunk, grant: tuple[float, float], pause: float) -> None:
        """Send a chunk to the cluster."""
        piece = Piece(chunk.job, active.document, chunk.start, chunk.stop)
        values = None if active.follow is None else active.follow.rows(chunk.start, chunk.stop).tolist()
        future = self.cluster.submit(run_chunk, self.parts.url, piece, *grant, values, pause)
        active.flying[chunk.start], active.granted[chunk.start] = (chunk, future), grant[0]
        future.add_done_callback(lambda f, job=chunk.job, start=chunk.start: self._came(job, start, f))

    def _give_back(self, chunks: list[Chunk], why: str) -> None:
        """Chunks of a job that were cut and cannot be sent now: they wait."""
        self.store.settle(self.name, chunks[0].job, {}, {c.start: Lost(why, 0.5, False) for c in chunks}, self.settings.attempts)

    def _came(self, job: str, start: int, future: Any) -> None:
        self.landed.put((job, start, future))
        self.woken.set()
