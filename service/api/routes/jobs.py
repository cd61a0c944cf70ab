"""/v1/jobs: submit, list, read, cancel and follow jobs, and derive a job from a job (rerun, extend)."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import APIRouter, Header, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel
from sse_starlette import EventSourceResponse, ServerSentEvent

from trunnion.basics.errors import Problem, SceneError
from trunnion.service.api.documents.job_document import Attempt, JobDocument, JobList, State, attempt_document, job_document
from trunnion.service.api.documents.job_request_examples import EXAMPLES
from trunnion.service.api.documents.problem_documents import Json, Refusal, error_responses, header_schema
from trunnion.service.api.job_data.job_rows import find_job, find_own_job, job_contents, result_rows
from trunnion.service.api.routes.tags_usage_audit import check_quota, forget
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import Caller, Reader, ServerState, Submitter
from trunnion.service.api.transport.request_bodies import body_schema, check_body
from trunnion.service.executor.job_stage import read_stage
from trunnion.service.executor.webhooks import is_allowed
from trunnion.service.request_models.job_request import JobRequest, current_document
from trunnion.service.request_workers import rerun_and_extend_plans as plans
from trunnion.service.request_workers import worker_tasks
from trunnion.service.store.store_records import Job
from trunnion.service.store.table_definitions import ENDED

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])
POLL_SECONDS = 0.4
MOST_STREAMS, STREAMS_OF_ONE = 500, 50
PLACE = header_schema("Location", "The job.")
AGAIN: Any = {
    "cpu_limit": {
        "summary": "Cases that ran out of time, with a higher limit",
        "value": {"outcomes": ["out_of_time"], "cpu_limit": "5 min"},
    },
    "all": {"summary": "All failed cases, with a method for stiff equations", "value": {"method": "rosenbrock"}},
}
MORE: Any = {"grid": {"summary": "More friction coefficients", "value": {"vary": {"joints.ball.friction.mu": "0.6:0.9:16"}}}}
NEW_JOB: dict[str, Any] = {
    "status_code": 202,
    "response_model": JobDocument,
    "responses": {202: {"description": "The new job.", **PLACE}, **error_responses(404, 409, 413)},
}
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
        200: {"model": JobDocument, "description": "The existing job that was submitted with this idempotency key.", **PLACE},
        202: PLACE,
        **error_responses(409, 413),
    },
    openapi_extra=body_schema(JobRequest, EXAMPLES),
)
async def submit_job(
    request: Request,
    caller: Submitter,
    s: ServerState,
    idempotency_key: Annotated[
        str | None,
        Header(max_length=255, min_length=1, description="A repeated request with the same key returns the existing job."),
    ] = None,
) -> Response:
    """Submit a batch. The header ``Location`` is the address of the job."""
    made = await check_body(s, request, caller, worker_tasks.plan_job)
    job, new = await run_in_threadpool(keep, s, caller, made, idempotency_key)
    return Json(job_document(job), 202 if new else 200, {"Location": f"/v1/jobs/{job.id}"})


def keep(s: Service, caller: Caller, made: dict[str, Any], key: str | None) -> tuple[Job, bool]:
    """Store a planned job. Returns the job, and whether the job is new. Refusal (429, 503) when the key or the server has too many
    jobs."""
    if made["notify"] and not is_allowed(made["notify"], s.settings.webhooks):
        hint = (
            f"an address below {' or '.join(s.settings.webhooks)}" if s.settings.webhooks else "start the server with --webhook URL"
        )
        raise SceneError([Problem("notify", "webhook address is not allowed", hint)])
    check_quota(s, caller, made["cases"])
    server = s.dispatcher.name if s.dispatcher.thread.is_alive() else None
    job, new = s.store.submit(caller.id, **made, key=key, server=server, lease=s.settings.lease)
    if new:
        s.dispatcher.start_job(job, made["document"])
    return job, new


@router.get("", response_model=JobList, responses=error_responses())
def list_jobs(
    caller: Reader,
    s: ServerState,
    state: Annotated[State | None, Query(description="Only jobs in this state.")] = None,
    scene: Annotated[str | None, Query(max_length=200, pattern="^[^\\x00]*$", description="Only jobs of this scene.")] = None,
    label: Annotated[str | None, Query(max_length=200, pattern="^[^\\x00]*$", description="Only jobs with this label.")] = None,
    tag: Annotated[str | None, Query(max_length=50, pattern="^[^\\x00]*$", description="Only jobs with this tag.")] = None,
    search: Annotated[
        str | None,
        Query(max_length=200, pattern="^[^\\x00]*$", description="Only jobs with this text in label, tags, scene or id."),
    ] = None,
    cursor: Annotated[str | None, Query(max_length=200, description="``next`` of the previous page.")] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 50,
) -> Response:
    """List jobs, newest first, one page for each request."""
    found, after = s.store.page(state, scene, label, tag, search, cursor, limit)
    return Json({"jobs": [job_document(j) for j in found], "next": after})


class JobFacts(BaseModel):
    """Number of cases and columns of a planned job."""

    cases: int
    columns: list[str]


@router.post("/check", response_model=JobFacts, responses=error_responses(413), openapi_extra=body_schema(JobRequest, EXAMPLES))
async def check_job(request: Request, caller: Reader, s: ServerState) -> Response:
    """Check a request without submitting it. Return facts about the planned job, or all problems."""
    return Response(await check_body(s, request, caller, worker_tasks.check_job), media_type="application/json")


@router.get("/{job}", response_model=JobDocument, responses=error_responses(404))
def get_job(job: str, caller: Reader, s: ServerState) -> Response:
    """Return a job: state, progress, rows by outcome, problems."""
    there = find_job(s, job)
    return Json(job_document(there, worker_stage(s, there)))


def worker_stage(s: Service, job: Job | None) -> str:
    """The stage that the first worker of a running job reports before the job has rows; "" for other jobs."""
    return read_stage(s.parts, job.id) if job is not None and job.state == "running" and not job.done else ""


@router.delete(
    "/{job}",
    response_model=JobDocument,
    responses={204: {"description": "The job is deleted."}, **error_responses(404, 409)},
)
def cancel_job(
    job: str,
    caller: Submitter,
    s: ServerState,
    purge: Annotated[bool, Query(description="Delete the ended job with its results.")] = False,
) -> Response:
    """Cancel a job of your own; with the role admin, cancel any job. The server keeps the computed rows. An ended job does not
    change. With ``purge``, delete an ended job."""
    find_own_job(s, caller, job)
    if purge:
        forget(s, caller, job)
        return Response(status_code=204)
    after = s.store.cancel(job)
    s.store.note(caller.id, "cancelled", job)
    s.dispatcher.wake()
    assert after is not None
    return Json(job_document(after))


@router.get("/{job}/request", responses={200: {"content": {"application/json": {"schema": REQUEST}}}, **error_responses(404)})
def get_job_request(job: str, caller: Reader, s: ServerState) -> Response:
    """Return the submitted request, with the full scene instead of its name and changes. The request can be submitted again."""
    find_job(s, job)
    return Json(current_document(s.store.document(job)))


@router.get("/{job}/attempts", response_model=list[Attempt], responses=error_responses(404))
def list_job_attempts(job: str, caller: Reader, s: ServerState) -> Response:
    """List the last 5000 attempts to run chunks of the job: time, worker, result."""
    find_job(s, job)
    return Json([attempt_document(a) for a in s.store.attempts(job)[-5000:]])


@router.get(
    "/{job}/events",
    response_class=EventSourceResponse,
    responses={
        200: {"description": "Server-sent events until the job has ended.", "content": {"text/event-stream": {"schema": EVENT}}},
        **error_responses(404),
    },
)
async def follow_job(
    job: str,
    request: Request,
    caller: Reader,
    s: ServerState,
    last_event_id: Annotated[
        str | None, Header(max_length=30, description="Id of the last event that the client received.")
    ] = None,
) -> Response:
    """Follow a job by server-sent events. The events are ``submitted``, ``started``, ``progress`` (with the job's document),
    ``chunk_retried``, ``chunk_failed`` and ``cancelling``. The last event is ``done``, ``failed`` or ``cancelled``."""
    await run_in_threadpool(find_job, s, job)
    if s.streams[caller.id] >= STREAMS_OF_ONE:
        raise Refusal(
            429, f"you already follow {STREAMS_OF_ONE} jobs; request the job repeatedly instead", headers={"Retry-After": "10"}
        )
    if s.streams.total() >= MOST_STREAMS:
        raise Refusal(503, "too many clients follow jobs; request the job repeatedly instead", headers={"Retry-After": "10"})
    after = int(last_event_id) if last_event_id and last_event_id.isascii() and last_event_id.isdigit() else 0
    return EventSourceResponse(_followed(s, caller, job, min(after, 2**62)), ping=15)


async def _followed(s: Service, caller: Caller, job: str, after: int) -> AsyncIterator[ServerSentEvent]:
    """The events of a job as server-sent events, each when it occurs, and the job's document after each change."""
    s.streams[caller.id] += 1
    sent = ""
    try:
        while True:
            now = await run_in_threadpool(s.store.job, job)
            fresh = await run_in_threadpool(s.store.events, job, after)
            for e in fresh:
                after = e.id
                yield ServerSentEvent(json.dumps({"time": e.time, **e.data}), event=e.kind, id=str(e.id))
            stage = await run_in_threadpool(worker_stage, s, now)
            document = job_document(now, stage) if now else {}
            progress = json.dumps({k: v for k, v in document.items() if k != "eta_seconds"})
            if progress != sent:
                sent = progress
                yield ServerSentEvent(json.dumps(document), event="progress")
            if not fresh and (now is None or now.state in ENDED):
                return
            await asyncio.sleep(POLL_SECONDS)
    finally:
        s.streams[caller.id] -= 1


@router.post("/{job}/rerun", **NEW_JOB, openapi_extra=body_schema(plans.RerunRequest, AGAIN))
async def rerun_job(job: str, request: Request, caller: Submitter, s: ServerState) -> Response:
    """Run the failed cases of a job again as a new job, with changed settings. The answer for an unknown job is 404, even if the
    body is wrong. The new job has the tag ``of:ID``, where ID is the id of the first job."""
    there = await run_in_threadpool(find_job, s, job)
    if there.state not in ENDED:
        raise Refusal(409, "the job has not ended")
    wanted = await check_body(s, request, caller, plans.rerun_outcomes)
    numbers = await s.reads.run(caller.id, lambda: _failed(s, there, wanted))
    document = await run_in_threadpool(s.store.document, job)
    made = await check_body(s, request, caller, plans.plan_rerun, document, numbers)
    return await run_in_threadpool(_follows, s, caller, there, made)


@router.post("/{job}/extend", **NEW_JOB, openapi_extra=body_schema(plans.ExtendRequest, MORE))
async def extend_job(job: str, request: Request, caller: Submitter, s: ServerState) -> Response:
    """Run more cases of the same scene as a new job with the same settings. Cases of the first job are skipped. The answer for an
    unknown job is 404, even if the body is wrong. The new job has the tag ``of:ID``, where ID is the id of the first job."""
    there = await run_in_threadpool(find_job, s, job)
    document = await run_in_threadpool(s.store.document, job)
    made = await check_body(s, request, caller, plans.plan_extension, document)
    return await run_in_threadpool(_follows, s, caller, there, made)


def _failed(s: Service, there: Job, wanted: list[str] | None) -> list[int]:
    """The cases to run again: cases with the wanted outcomes, and cases without a row. wanted: None means all outcomes except done.
    Refusal (409) when there is no case to run."""
    import pyarrow as pa

    schema = job_contents(s, there.id).schema
    shown, has, again = pa.schema([schema.field(n) for n in ("case", "outcome")]), set(), list[int]()
    for table in result_rows(s, there.id, shown, 0, there.cases):
        for case, outcome in zip(table["case"].to_pylist(), table["outcome"].to_pylist(), strict=True):
            has.add(case)
            if outcome in wanted if wanted is not None else outcome != "done":
                again.append(case)
    again += [i for i in range(there.cases) if i not in has]
    if not again:
        raise Refusal(409, "the job has no case that could run again")
    return sorted(again)


def _follows(s: Service, caller: Any, there: Job, made: dict[str, Any]) -> Response:
    """Store a new job that was derived from the job ``there``."""
    tags = [*[t for t in made["tags"] if not t.startswith("of:")], f"of:{there.id}"]
    job, _ = keep(s, caller, made | {"tags": tags, "label": made["label"] or there.label}, None)
    return Json(job_document(job), 202, {"Location": f"/v1/jobs/{job.id}"})
