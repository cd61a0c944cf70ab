"""The jobs that this server leases. The server renews their leases, takes over jobs without a lease, and ends finished jobs.

The server may end at any moment. When another server takes over a job, a chunk that is stored as ``running`` counts as done if its
part exists. Otherwise the chunk runs again."""

from __future__ import annotations

import json
import queue
import secrets
import time
from dataclasses import replace
from math import inf
from typing import Any

from trunnion.analysis.studies.study_rounds import StudyProgress
from trunnion.service.basics.server_settings import Settings
from trunnion.service.executor.active_job import ActiveJob
from trunnion.service.executor.chunk_size import COMMIT_SIZE
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange, digest_of, document_bytes
from trunnion.service.executor.study_round_results import round_results
from trunnion.service.request_models.job_request import current_settings, study_of_document
from trunnion.service.store.leases_and_chunks import ChunkReport, FailedAttempt, LeaseLost, WorkStore
from trunnion.service.store.store_records import Chunk, Job


class LeasedJobs:
    """The jobs that this server leases. name: the server's name in leases. returned: (job, first case, future) of chunks that
    returned from the cluster and are not stored yet. submitted: (new job, text of its document) of leased jobs that have not
    started. claimed: monotonic time of the last claim, s. renewed: monotonic time of the last renewal, s."""

    def __init__(self, store: WorkStore, parts: Parts, settings: Settings):
        self.store, self.parts, self.settings = store, parts, settings
        self.name = secrets.token_hex(8)
        self.jobs: dict[str, ActiveJob] = {}
        self.returned: queue.SimpleQueue[tuple[str, int, Any]] = queue.SimpleQueue()
        self.submitted: queue.SimpleQueue[tuple[Job, str]] = queue.SimpleQueue()
        self.claimed = self.renewed = -1e9

    def _renew(self) -> None:
        """Renew the leases during long work. The renewal can also lease new jobs. The next ``_claim`` starts these jobs."""
        if time.monotonic() - max(self.claimed, self.renewed) > self.settings.lease / 3:
            self.store.claim(self.name, self.settings.lease)
            self.renewed = time.monotonic()

    def _claim(self) -> None:
        """Renew leases, take over jobs without a lease, and drop jobs whose lease is lost or that have ended."""
        held = {j.id: j for j in self.store.claim(self.name, self.settings.lease)}
        self.claimed = time.monotonic()
        for gone in self.jobs.keys() - held.keys():
            self._forget(self.jobs[gone])
        for job in held.values():
            if job.id in self.jobs:
                self.jobs[job.id].job = job
            else:
                self._take_over(job, self.store.document(job.id))

    def _start_submitted(self) -> None:
        """Start the jobs that were submitted since the last turn."""
        while not self.submitted.empty():
            job, document = self.submitted.get()
            if job.id not in self.jobs:  # a claim may have started the job
                self._take_over(job, json.loads(document))

    def _take_over(self, job: Job, document: dict[str, Any]) -> None:
        """Start a newly leased job, or resume it. A job whose lease is lost is dropped."""
        data = document_bytes(document)
        if job.state != "cancelling":
            self.parts.write(self.parts.job_file(job.id), data)
        spent = job.seconds + job.build_seconds
        active = ActiveJob(job, planned=job.planned, spent=spent, document=digest_of(data))
        active.apart = active.warm = document.get("fit") is not None
        active.cpu_limit = inf if active.apart else current_settings(document).get("cpu_limit") or self.settings.limits.cpu_limit
        if job.done and job.seconds:
            active.cost = job.seconds / job.done
        study = study_of_document(document)
        if study is not None and job.state != "cancelling":
            active.follow = StudyProgress(study)
        self.jobs[job.id] = active
        try:
            self._settle_running(active, job.state == "queued")
        except LeaseLost:
            self._forget(active)

    def _settle_running(self, active: ActiveJob, is_new: bool = False) -> None:
        """Settle the chunks that are stored as running but have no future in this server. An earlier server sent these chunks, or a
        commit was interrupted. is_new: whether the job had no chunks when this server leased it."""
        running = [] if is_new else self.store.running(active.job.id)
        left = [chunk for chunk in running if chunk.start not in active.flying]
        there = self.parts.names(active.job.id) if left else set()
        for k in range(0, len(left), COMMIT_SIZE):
            self._settle_chunks(active, left[k : k + COMMIT_SIZE], there)
        if not is_new:
            self.store.begin(self.name, active.job.id)
        active.sure = True
        self._advance_study(active)

    def _mark_uncertain(self) -> None:
        """Record that a write was interrupted. The store can then contain chunks that this server does not have in memory."""
        for active in self.jobs.values():
            active.sure = False

    def _settle_chunks(self, active: ActiveJob, chunks: list[Chunk], there: set[str]) -> None:
        """Settle chunks without a future. A chunk is done if its part is among the file names ``there`` and is valid. Otherwise the
        chunk runs again."""
        done: dict[int, ChunkReport] = {}
        for chunk in chunks:
            self._renew()
            case_range = CaseRange(chunk.job, active.document, chunk.start, chunk.stop)
            found = self.parts.part_outcomes(case_range) if self.parts.part(case_range).rpartition("/")[2] in there else None
            if found is not None:
                done[chunk.start] = ChunkReport(found[0], 0.0, 0.0, found[1], version=found[2])
        gone = {c.start: FailedAttempt("its server was lost", 0.0, False) for c in chunks if c.start not in done}
        self._renew()
        self.store.record_outcomes(self.name, active.job.id, done, gone, self.settings.attempts)

    def _forget(self, active: ActiveJob) -> None:
        for _, future in active.flying.values():
            future.cancel()
        self.jobs.pop(active.job.id, None)

    def _check_job(self, active: ActiveJob) -> None:
        """End the job if all its cases are over or it was cancelled, and find lost futures."""
        if active.job.state == "cancelling":
            self._stop_job(active, "cancelled", [])
            return
        if not active.sure:
            self._settle_running(active)
        if time.monotonic() - active.looked < 1.0:
            return
        active.looked = time.monotonic()
        for start, (_, future) in list(active.flying.items()):
            if future.status in ("cancelled", "lost"):
                self.returned.put((active.job.id, start, future))
        if max(active.planned, active.job.planned) >= active.known:  # an earlier query would only cost a transaction
            self._end_if_over(active)

    def _stop_job(self, active: ActiveJob, state: str, problems: list[dict[str, Any]]) -> None:
        """End a job early. A stop marker (a file) tells the workers of the job to stop."""
        if active.flying:
            self.parts.write(self.parts.marker(active.job.id), b"")
        self.store.end(self.name, active.job.id, state, problems)
        self._forget(active)

    def _advance_study(self, active: ActiveJob) -> None:
        """Report complete rounds to the study, and request the cases of the next round. The requested cases depend only on the seed
        and the results. Therefore a study continues unchanged when another server takes the study over."""
        follow, asked = active.follow, -1
        while follow is not None and not follow.is_over and asked != follow.requested:
            asked = follow.requested
            seen = round_results(self.store, self.parts, active.job.id, active.document, follow)
            if seen is not None:
                follow.report(seen)
        if follow is not None and (follow.is_over or follow.requested > (active.job.asked or 0)):
            self.store.ask(self.name, active.job.id, follow.requested, follow.is_over)
            active.job = replace(active.job, asked=follow.requested, cases=follow.requested if follow.is_over else active.job.cases)
            active.nothing_until = 0.0

    def _end_if_over(self, active: ActiveJob) -> None:
        if active.follow is not None and not active.flying:
            self._advance_study(active)
        if not active.flying and self.store.end_if_over(self.name, active.job.id) is not None:
            self._forget(active)
