"""/v1/jobs: submit a batch, list jobs, look at one, cancel it, follow its events."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel
from sse_starlette import EventSourceResponse, ServerSentEvent

from engine.basics.problems import Problem, SceneError
from service.api.bodies import asks, told
from service.api.documents import Attempt, JobDocument, JobList, State, attempt_document, job_document
from service.api.examples import EXAMPLES
from service.api.keeping import afford, forget, found, owned
from service.api.problems import Json, Refusal, documented, with_header
from service.api.security import Caller, need
from service.api.service import Service, service
from service.executor.stages import stage_kept
from service.executor.telling import allowed
from service.request import JobRequest
from service.store.rows import Job
from service.store.tables import ACTIVE, ENDED

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])
Here = Annotated[Service, Depends(service)]
Reader = Annotated[Caller, Depends(need("read"))]
Submitter = Annotated[Caller, Depends(need("submit"))]
POLL_SECONDS = 0.4
MOST_STREAMS, STREAMS_OF_ONE = 500, 50
PLACE = with_header("Location", "The job.")
REQUEST: dict[str, Any] = {"$ref": "#/components/schemas/JobRequest"}
EVENT: dict[str, Any] = {
    "type": "object",
    "description": "One event; its data is a JSON text.",
    "required": ["event", "data"],
    "properties": {
        "id": {"type": "string"},
        "event": {"type": "string"},
        "data": {"type": "string", "contentMediaType": "application/json"},
    },
}


@router.post(
    "",
    status_code=202,
    response_model=JobDocument,
    responses={
        200: {"model": JobDocument, "description": "The job this idempotency key made before.", **PLACE},
        202: PLACE,
        **documented(409, 413),
    },
    openapi_extra=asks(JobRequest, EXAMPLES),
)
async def submit(
    request: Request,
    caller: Submitter,
    s: Here,
    idempotency_key: Annotated[
        str | None, Header(max_length=255, min_length=1, description="Sent again with the same request, makes no second job.")
    ] = None,
) -> Response:
    """Submit a batch. The answer's ``Location`` is the job."""
    made = await told(s, request, caller, "plan_job")
    job, new = await run_in_threadpool(keep, s, caller, made, idempotency_key)
    return Json(job_document(job), 202 if new else 200, {"Location": f"/v1/jobs/{job.id}"})


def keep(s: Service, caller: Caller, made: dict[str, Any], key: str | None) -> tuple[Job, bool]:
    """Keep a job that is understood; (job, whether it is new). Refusal (503) when too many wait."""
    states = s.store.states()
    if sum(states[x] for x in ACTIVE) >= s.settings.limits.waiting:
        raise Refusal(503, "too many jobs are waiting; try again later", headers={"Retry-After": "60"})
    if made["notify"] and not allowed(made["notify"], s.settings.webhooks):
        hint = f"below {' or '.join(s.settings.webhooks)}" if s.settings.webhooks else "start the server with --webhook URL"
        raise SceneError([Problem("notify", "this server does not tell that address", hint)])
    afford(s, caller, made["cases"])
    job, new = s.store.submit(caller.id, **made, key=key)
    if new:
        s.store.note(caller.id, "submitted", job.id, cases=job.cases, scene=job.scene)
        s.dispatcher.wake()
    return job, new


@router.get("", response_model=JobList, responses=documented())
def jobs(
    caller: Reader,
    s: Here,
    state: Annotated[State | None, Query(description="Only jobs in this state.")] = None,
    scene: Annotated[str | None, Query(max_length=200, pattern="^[^\\x00]*$", description="Only jobs of this scene.")] = None,
    label: Annotated[str | None, Query(max_length=200, pattern="^[^\\x00]*$", description="Only jobs with this label.")] = None,
    tag: Annotated[str | None, Query(max_length=50, pattern="^[^\\x00]*$", description="Only jobs with this tag.")] = None,
    search: Annotated[
        str | None, Query(max_length=200, pattern="^[^\\x00]*$", description="Only jobs with this in label, tags, scene or id.")
    ] = None,
    cursor: Annotated[str | None, Query(max_length=200, description="``next`` of the page before.")] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 50,
) -> Response:
    """List jobs, newest first, a page at a time."""
    found, after = s.store.page(state, scene, label, tag, search, cursor, limit)
    return Json({"jobs": [job_document(j) for j in found], "next": after})


class JobFacts(BaseModel):
    """What a request would make."""

    cases: int
    columns: list[str]


@router.post("/check", response_model=JobFacts, responses=documented(413), openapi_extra=asks(JobRequest, EXAMPLES))
async def check(request: Request, caller: Reader, s: Here) -> Response:
    """What a request would make, or every problem it has; nothing is submitted."""
    return Response(await told(s, request, caller, "check_job"), media_type="application/json")


@router.get("/{job}", response_model=JobDocument, responses=documented(404))
def job(job: str, caller: Reader, s: Here) -> Response:
    """A job: state, progress, rows by outcome, what went wrong."""
    there = found(s, job)
    return Json(job_document(there, told_stage(s, there)))


def told_stage(s: Service, job: Job | None) -> str:
    """What the first worker of a job that has no rows yet says that it is at."""
    return stage_kept(s.parts, job.id) if job is not None and job.state == "running" and not job.done else ""


@router.delete(
    "/{job}",
    response_model=JobDocument,
    responses={204: {"description": "It is deleted."}, **documented(404, 409)},
)
def cancel(
    job: str,
    caller: Submitter,
    s: Here,
    purge: Annotated[bool, Query(description="Delete the job, which must have ended, with all its results.")] = False,
) -> Response:
    """Cancel a job of one's own (role admin: any). Rows computed so far are kept; a job that has ended stays as it is, or with
    ``purge`` is deleted."""
    owned(s, caller, job)
    if purge:
        forget(s, caller, job)
        return Response(status_code=204)
    after = s.store.cancel(job)
    s.store.note(caller.id, "cancelled", job)
    s.dispatcher.wake()
    assert after is not None
    return Json(job_document(after))


@router.get("/{job}/request", responses={200: {"content": {"application/json": {"schema": REQUEST}}}, **documented(404)})
def asked(job: str, caller: Reader, s: Here) -> Response:
    """What was submitted, with the scene itself in place of its name and changes. The document can be submitted again."""
    found(s, job)
    return Json(s.store.document(job))


@router.get("/{job}/attempts", response_model=list[Attempt], responses=documented(404))
def attempts(job: str, caller: Reader, s: Here) -> Response:
    """The last 5000 attempts at chunks of the job: when, where, what became of them."""
    found(s, job)
    return Json([attempt_document(a) for a in s.store.attempts(job)[-5000:]])


@router.get(
    "/{job}/events",
    response_class=EventSourceResponse,
    responses={
        200: {"description": "Events until the job has ended.", "content": {"text/event-stream": {"schema": EVENT}}},
        **documented(404),
    },
)
async def events(
    job: str,
    request: Request,
    caller: Reader,
    s: Here,
    last_event_id: Annotated[str | None, Header(max_length=30, description="Go on after this event.")] = None,
) -> Response:
    """Follow a job: server-sent events ``submitted``, ``started``, ``progress`` (the job's document), ``chunk_retried``,
    ``chunk_failed``, ``cancelling``, and one of ``done``, ``failed``, ``cancelled`` at the end."""
    await run_in_threadpool(found, s, job)
    if s.streams[caller.id] >= STREAMS_OF_ONE:
        raise Refusal(429, f"you follow {STREAMS_OF_ONE} jobs already; poll instead", headers={"Retry-After": "10"})
    if s.streams.total() >= MOST_STREAMS:
        raise Refusal(503, "too many clients follow jobs; poll instead", headers={"Retry-After": "10"})
    after = int(last_event_id) if last_event_id and last_event_id.isascii() and last_event_id.isdigit() else 0
    return EventSourceResponse(_followed(s, caller, job, min(after, 2**62)), ping=15)


async def _followed(s: Service, caller: Caller, job: str, after: int) -> AsyncIterator[ServerSentEvent]:
    """The job's events as they come, and its document whenever that has changed."""
    s.streams[caller.id] += 1
    told = ""
    try:
        while True:
            now = await run_in_threadpool(s.store.job, job)
            fresh = await run_in_threadpool(s.store.events, job, after)
            for e in fresh:
                after = e.id
                yield ServerSentEvent(json.dumps({"time": e.time, **e.data}), event=e.kind, id=str(e.id))
            stage = await run_in_threadpool(told_stage, s, now)
            document = job_document(now, stage) if now else {}
            progress = json.dumps({k: v for k, v in document.items() if k != "eta_seconds"})
            if progress != told:
                told = progress
                yield ServerSentEvent(json.dumps(document), event="progress")
            if not fresh and (now is None or now.state in ENDED):
                return
            await asyncio.sleep(POLL_SECONDS)
    finally:
        s.streams[caller.id] -= 1
