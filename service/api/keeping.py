"""Housekeeping over REST: labels and tags, deleting, what a key has used, the record of who did what."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, Query
from pydantic import BaseModel, Field
from starlette.responses import Response

from engine.basics.problems import Problem
from service.api.documents import JobDocument, job_document, stamp
from service.api.problems import Json, Refusal, documented
from service.api.security import Caller, need
from service.api.service import Service, service
from service.request import Asked, Plain, Tag
from service.settings import Limits
from service.store.keeping import Usage
from service.store.rows import Job

router = APIRouter(prefix="/v1", tags=["housekeeping"])
Here = Annotated[Service, Depends(service)]
MARKS: Any = {"tags": {"summary": "Find it again", "value": {"label": "guide, second try", "tags": ["guide", "2026-03"]}}}


class Marks(Asked):
    """What a job is called: its label, its tags; what is not given stays."""

    label: Plain | None = None
    tags: list[Tag] | None = Field(None, max_length=20)


class UsageDocument(BaseModel):
    """What a key has, and what it may have."""

    jobs: int = Field(description="Queued or running.")
    bytes: int = Field(description="Of results kept.")
    cases: int = Field(description="Submitted within a day.")
    most: dict[str, float]


class DeedDocument(BaseModel):
    """Something that was done."""

    id: int
    time: str
    who: str = Field(description="Id of the key; local without keys, server for what it did by itself.")
    what: str
    about: str = Field(description="Id of the job or key.")
    data: dict[str, Any]


def found(s: Service, job: str) -> Job:
    """A job by id; Refusal (404)."""
    there = s.store.job(job) if job.isalnum() and job.isascii() and len(job) == 24 else None
    if there is None:
        raise Refusal(404, "there is no such job")
    return there


def owned(s: Service, caller: Caller, job: str) -> Job:
    """A job that the caller may change: its owner's, or any for the role admin. Refusal (403, 404)."""
    there = found(s, job)
    if caller.role != "admin" and there.owner != caller.id:
        raise Refusal(403, "this is the job of another key: its owner or a key with the role admin may do that")
    return there


def afford(s: Service, caller: Caller, cases: int) -> None:
    """Refusal (429) when a key has all that it may have; every reason is told."""
    has, limits = s.store.usage(caller.id), s.settings.limits
    over = [
        Problem(f"quota.{name}", f"{now:.6g} and {more:.6g} more are beyond the {most:.6g} of a key: {what}", hint)
        for name, now, more, most, what, hint in (
            ("jobs", has.jobs, 1, limits.key_jobs, "jobs queued or running", "wait until one has ended, or cancel one"),
            ("bytes", has.bytes, 0, limits.key_bytes, "bytes of results", "delete jobs that are not needed any more"),
            ("cases", has.cases, cases, limits.key_cases, "cases a day", "come back tomorrow"),
        )
        if now + more > most
    ]
    if over:
        raise Refusal(429, "", over, {"Retry-After": "600"})


def forget(s: Service, caller: Caller, job: str) -> None:
    """Delete a job that has ended with all its results; Refusal (409) while it goes on."""
    there = found(s, job)
    if not s.keeper.delete(there, caller.id):
        raise Refusal(409, "the job has not ended: cancel it first")
    s.library.jobs.pop(job, None)


@router.patch("/jobs/{job}", response_model=JobDocument, responses=documented(404, 413))
def mark(
    job: str, marks: Annotated[Marks, Body(openapi_examples=MARKS)], caller: Annotated[Caller, Depends(need("submit"))], s: Here
) -> Response:
    """Give a job of one's own (role admin: any) another label or other tags."""
    owned(s, caller, job)
    s.store.mark(job, marks.label, marks.tags)
    return Json(job_document(found(s, job)))


@router.get("/usage", response_model=UsageDocument, responses=documented())
def usage(caller: Annotated[Caller, Depends(need("read"))], s: Here) -> Response:
    """What your key has used, and what it may."""
    return Json(usage_document(s.store.usage(caller.id), s.settings.limits))


def usage_document(has: Usage, limits: Limits) -> dict[str, Any]:
    """What a key has, as clients see it."""
    most = {"jobs": limits.key_jobs, "bytes": limits.key_bytes, "cases": limits.key_cases}
    return {"jobs": has.jobs, "bytes": has.bytes, "cases": has.cases, "most": most}


@router.get("/audit", response_model=list[DeedDocument], responses=documented())
def audit(
    caller: Annotated[Caller, Depends(need("admin"))],
    s: Here,
    after: Annotated[int, Query(ge=0, le=2**62, description="Only records after the one with this id.")] = 0,
    who: Annotated[str | None, Query(max_length=64, pattern="^[^\\x00]*$", description="Only what this key did.")] = None,
    about: Annotated[str | None, Query(max_length=64, pattern="^[^\\x00]*$", description="Only about this job or key.")] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Response:
    """Who did what: jobs submitted, cancelled, deleted; keys made and revoked. In order, oldest first."""
    return Json([d.__dict__ | {"time": stamp(d.time)} for d in s.store.deeds(after, limit, who, about)])
