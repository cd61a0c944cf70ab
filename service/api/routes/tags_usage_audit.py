"""/v1/jobs/{id} (label and tags), /v1/usage (usage and quotas) and /v1/audit (the audit log)."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Query
from pydantic import BaseModel, Field
from starlette.responses import Response

from trunnion.basics.errors import Problem
from trunnion.service.api.documents.job_document import JobDocument, job_document, rfc3339
from trunnion.service.api.documents.problem_documents import Json, Refusal, error_responses
from trunnion.service.api.job_data.job_rows import find_job, find_own_job
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import Admin, Caller, Reader, ServerState, Submitter
from trunnion.service.request_models.job_request import PlainText, RequestModel, Tag

router = APIRouter(prefix="/v1", tags=["housekeeping"])
LABEL_EXAMPLES: Any = {"tags": {"summary": "Label and tags", "value": {"label": "guide, second try", "tags": ["guide", "2026-03"]}}}


class LabelAndTags(RequestModel):
    """New label and tags of a job; omitted fields do not change."""

    label: PlainText | None = None
    tags: list[Tag] | None = Field(None, max_length=20)


class UsageDocument(BaseModel):
    """Usage of a key, and its quotas (``most``)."""

    jobs: int = Field(description="Number of queued or running jobs.")
    bytes: int = Field(description="Size of the stored results.")
    cases: int = Field(description="Number of cases submitted within a day.")
    most: dict[str, float]


class AuditRecordDocument(BaseModel):
    """An entry of the audit log."""

    id: int
    time: str
    who: str = Field(description="Id of the key; local on a server without keys; server for actions of the server itself.")
    what: str
    about: str = Field(description="Id of the job or key.")
    data: dict[str, Any]


def check_quota(s: Service, caller: Caller, cases: int) -> None:
    """Raise Refusal when the server does not accept a job with this number of cases: 503 when too many jobs are active, otherwise
    429 with every exceeded quota of the key."""
    has, limits = s.store.usage(caller.id), s.settings.limits
    if has["waiting"] >= limits.waiting:
        raise Refusal(503, "too many jobs are waiting; try again later", headers={"Retry-After": "60"})
    over = [
        Problem(f"quota.{name}", f"{now:.6g} {what} and {more:.6g} more exceed the {most:.6g} allowed for a key", hint)
        for name, now, more, most, what, hint in (
            ("jobs", has["jobs"], 1, limits.key_jobs, "jobs queued or running", "wait until one has ended, or cancel one"),
            ("bytes", has["bytes"], 0, limits.key_bytes, "bytes of results", "delete jobs"),
            ("cases", has["cases"], cases, limits.key_cases, "cases a day", "submit them tomorrow"),
        )
        if now + more > most
    ]
    if over:
        raise Refusal(429, "", over, {"Retry-After": "600"})


def forget(s: Service, caller: Caller, job: str) -> None:
    """Delete an ended job with its results. Refusal (409) if the job has not ended."""
    there = find_job(s, job)
    if not s.retention.delete(there, caller.id):
        raise Refusal(409, "the job has not ended: cancel it first")
    s.contents.pop(job, None)


@router.patch("/jobs/{job}", response_model=JobDocument, responses=error_responses(404, 413))
def mark_job(
    job: str, marks: Annotated[LabelAndTags, Body(openapi_examples=LABEL_EXAMPLES)], caller: Submitter, s: ServerState
) -> Response:
    """Change the label or the tags of a job of your own. With the role admin, the job may be anyone's."""
    find_own_job(s, caller, job)
    s.store.mark(job, marks.label, marks.tags)
    return Json(job_document(find_job(s, job)))


@router.get("/usage", response_model=UsageDocument, responses=error_responses())
def get_usage(caller: Reader, s: ServerState) -> Response:
    """Return the usage and the quotas of your key."""
    limits = s.settings.limits
    most = {"jobs": limits.key_jobs, "bytes": limits.key_bytes, "cases": limits.key_cases}
    has = s.store.usage(caller.id)
    return Json({name: has[name] for name in most} | {"most": most})


@router.get("/audit", response_model=list[AuditRecordDocument], responses=error_responses())
def list_audit(
    caller: Admin,
    s: ServerState,
    after: Annotated[int, Query(ge=0, le=2**62, description="Only records after the record with this id.")] = 0,
    who: Annotated[str | None, Query(max_length=64, pattern="^[^\\x00]*$", description="Only actions of this key.")] = None,
    about: Annotated[
        str | None, Query(max_length=64, pattern="^[^\\x00]*$", description="Only actions on this job or key.")
    ] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Response:
    """List the audit log, oldest record first: jobs submitted, cancelled and deleted, keys made and revoked."""
    return Json([d | {"time": rfc3339(d["time"])} for d in s.store.audit_records(after, limit, who, about)])
