"""The jobs this server works on: it holds a lease on each, renews it, takes over what nobody works on, and ends what is over.

What is kept here in memory can be lost at any moment: chunks found ``running`` when a job is taken over are done when their part is
there, and are run again when it is not.
"""

from __future__ import annotations

import queue
import secrets
import time
from dataclasses import replace
from math import inf
from typing import Any

from engine.studies.following import Follow
from service.executor.active import Active
from service.executor.follows import seen_in
from service.executor.parts import Parts
from service.executor.sealed import Piece, digest_of, document_bytes
from service.executor.sizing import TOGETHER
from service.request import study_of_document
from service.settings import Settings
from service.store.rows import Chunk, Job
from service.store.work import Done, Lost, WorkStore


class HeldJobs:
    """Jobs by id, under the leases of one server. name: the server's, in leases; landed: (job, first case, future) of what came
    back from the cluster and is not recorded yet; claimed: when jobs were last claimed, renewed: when leases were renewed besides,
    s of the monotonic clock."""

    def __init__(self, store: WorkStore, parts: Parts, settings: Settings):
        self.store, self.parts, self.settings = store, parts, settings
        self.name = secrets.token_hex(8)
        self.jobs: dict[str, Active] = {}
        self.landed: queue.SimpleQueue[tuple[str, int, Any]] = queue.SimpleQueue()
        self.claimed = self.renewed = -1e9

    def _renew(self) -> None:
        """Hold on to the jobs held while something takes longer than a lease lasts. What is claimed besides waits for its turn."""
        if time.monotonic() - max(self.claimed, self.renewed) > self.settings.lease / 3:
            self.store.claim(self.name, self.settings.lease)
            self.renewed = time.monotonic()

    def _claim(self) -> None:
        """Renew leases; take over what nobody works on; drop what was lost or has ended."""
        held = {j.id: j for j in self.store.claim(self.name, self.settings.lease)}
        self.claimed = time.monotonic()
        for gone in self.jobs.keys() - held.keys():
            self._forget(self.jobs[gone])
        for job in held.values():
            if job.id in self.jobs:
                self.jobs[job.id].job = job
            else:
                self._adopt(job)

    def _adopt(self, job: Job) -> None:
        """Begin a job whose lease was just taken, or resume it where another server left it."""
        document = self.store.document(job.id)
        if job.state != "cancelling":
            self.parts.write(self.parts.job_file(job.id), document_bytes(document))
        spent = job.seconds + job.build_seconds
        active = Active(job, planned=job.planned, spent=spent, document=digest_of(document_bytes(document)))
        active.apart = active.warm = document.get("fit") is not None
        active.patience = inf if active.apart else document.get("patience") or self.settings.limits.patience
        if job.done and job.seconds:
            active.cost = job.seconds / job.done
        study = study_of_document(document)
        if study is not None and job.state != "cancelling":
            active.follow = Follow(study)
        self.jobs[job.id] = active
        self._take_stock(active)

    def _take_stock(self, active: Active) -> None:
        """Settle chunks that are recorded as running while nothing here works on them: those of the server before this one, and
        those whose cutting was recorded although the database was gone before it could say so."""
        left = [chunk for chunk in self.store.running(active.job.id) if chunk.start not in active.flying]
        there = self.parts.names(active.job.id) if left else set()
        for k in range(0, len(left), TOGETHER):
            self._settle(active, left[k : k + TOGETHER], there)
        self.store.begin(self.name, active.job.id)
        active.sure = True
        self._go_on(active)

    def _doubt(self) -> None:
        """Something broke off: what is recorded may be more than what is known here."""
        for active in self.jobs.values():
            active.sure = False

    def _settle(self, active: Active, chunks: list[Chunk], there: set[str]) -> None:
        """Decide on chunks whose futures are gone: those are done whose parts are there (``there``: names of files), the others are
        run again."""
        done: dict[int, Done] = {}
        for chunk in chunks:
            self._renew()
            piece = Piece(chunk.job, active.document, chunk.start, chunk.stop)
            found = self.parts.counted(piece) if self.parts.part(piece).rpartition("/")[2] in there else None
            if found is not None:
                done[chunk.start] = Done(found[0], 0.0, 0.0, found[1])
        gone = {c.start: Lost("its server went away", 0.0, False) for c in chunks if c.start not in done}
        self._renew()
        self.store.settle(self.name, active.job.id, done, gone, self.settings.attempts)

    def _forget(self, active: Active) -> None:
        for _, future in active.flying.values():
            future.cancel()
        self.jobs.pop(active.job.id, None)

    def _look_after(self, active: Active) -> None:
        """Cancel or end the job when it is time, and find chunks whose futures were lost without a result."""
        if active.job.state == "cancelling":
            self._stop_job(active, "cancelled", [])
            return
        if not active.sure:
            self._take_stock(active)
        if time.monotonic() - active.looked < 1.0:
            return
        active.looked = time.monotonic()
        for start, (_, future) in list(active.flying.items()):
            if future.status in ("cancelled", "lost"):
                self.landed.put((active.job.id, start, future))
        self._end_if_over(active)

    def _stop_job(self, active: Active, state: str, problems: list[dict[str, Any]]) -> None:
        """End a job before its time; its workers see the marker."""
        if active.flying:
            self.parts.write(self.parts.marker(active.job.id), b"")
        self.store.end(self.name, active.job.id, state, problems)
        self._forget(active)

    def _go_on(self, active: Active) -> None:
        """Tell a study the results there are, and ask it for more cases, as often as its rounds are there whole. What it asks for
        follows from its seed and from these results, so that a study that is taken over goes on as it would have."""
        follow, asked = active.follow, -1
        while follow is not None and not follow.over and asked != follow.asked:
            asked = follow.asked
            seen = seen_in(self.store, self.parts, active.job.id, active.document, follow)
            if seen is not None:
                follow.tell(seen)
        if follow is not None and (follow.over or follow.asked > (active.job.asked or 0)):
            self.store.ask(self.name, active.job.id, follow.asked, follow.over)
            active.job = replace(active.job, asked=follow.asked, cases=follow.asked if follow.over else active.job.cases)
            active.nothing_until = 0.0

    def _end_if_over(self, active: Active) -> None:
        if active.follow is not None and not active.flying:
            self._go_on(active)
        if not active.flying and self.store.end_if_over(self.name, active.job.id) is not None:
            self._forget(active)
