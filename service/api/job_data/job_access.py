"""Jobs by the ids in requests, and who may change them."""

from __future__ import annotations

from trunnion.service.api.documents.problem_documents import Refusal
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import Caller
from trunnion.service.store.job_and_chunk_records import Job


def find_job(s: Service, job: str) -> Job:
    """A job by its id; Refusal (404)."""
    record = s.store.job(job) if job.isalnum() and job.isascii() and len(job) == 24 else None
    if record is None:
        raise Refusal(404, "no such job")
    return record


def find_own_job(s: Service, caller: Caller, job: str) -> Job:
    """A job that the caller may change: the caller's own, or any for the role admin. Refusal (403, 404)."""
    record = find_job(s, job)
    if caller.role != "admin" and record.owner != caller.id:
        raise Refusal(403, "the job belongs to another key: only its owner or a key with the role admin may change it")
    return record
