"""Finds jobs by their ids, and checks whether the caller may change a job."""

from __future__ import annotations

from trunnion.service.api.documents.problem_documents import Refusal
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import Caller
from trunnion.service.store.job_and_chunk_records import Job


def find_job(s: Service, job: str) -> Job:
    """The job with this id; Refusal (404) if there is none."""
    record = s.store.job(job) if job.isalnum() and job.isascii() and len(job) == 24 else None
    if record is None:
        raise Refusal(404, "no such job")
    return record


def find_own_job(s: Service, caller: Caller, job: str) -> Job:
    """The job with this id, if the caller may change it: an owned job, or for the role admin any job. Else Refusal (403, 404)."""
    record = find_job(s, job)
    if caller.role != "admin" and record.owner != caller.id:
        raise Refusal(403, "the job belongs to another key: only its owner or a key with the role admin may change it")
    return record
