"""/v1/jobs/{id}/rerun and /extend: new jobs that are derived from a job."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool

from trunnion.service.api.documents.job_document import JobDocument, job_document
from trunnion.service.api.documents.problem_documents import Json, Refusal, error_responses
from trunnion.service.api.job_data.job_access import find_job
from trunnion.service.api.job_data.job_rows import job_contents, result_rows
from trunnion.service.api.routes.jobs import PLACE, keep
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import ServerState, Submitter
from trunnion.service.api.transport.request_bodies import body_schema, check_body
from trunnion.service.request_workers import rerun_and_extend_plans as plans
from trunnion.service.store.job_and_chunk_records import Job
from trunnion.service.store.table_definitions import ENDED

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])
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


@router.post("/{job}/rerun", **NEW_JOB, openapi_extra=body_schema(plans.RerunRequest, AGAIN))
async def rerun_job(job: str, request: Request, caller: Submitter, s: ServerState) -> Response:
    """Run the failed cases of a job again as a new job, with changed settings. The new job has the tag ``of:ID``, where ID is the
    id of the first job."""
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
    """Run more cases of the same scene as a new job with the same settings. Cases of the first job are skipped. The new job has the
    tag ``of:ID``, where ID is the id of the first job."""
    there = await run_in_threadpool(find_job, s, job)
    document = await run_in_threadpool(s.store.document, job)
    made = await check_body(s, request, caller, plans.plan_extension, document)
    return await run_in_threadpool(_follows, s, caller, there, made)


def _failed(s: Service, there: Job, wanted: list[str] | None) -> list[int]:
    """The cases to run again: cases with the wanted outcomes (None: all but done), and cases without a row. Refusal (409) when
    there is no such case."""
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
    """Store a job that is derived from the job ``there``."""
    tags = [*[t for t in made["tags"] if not t.startswith("of:")], f"of:{there.id}"]
    job, _ = keep(s, caller, made | {"tags": tags, "label": made["label"] or there.label}, None)
    return Json(job_document(job), 202, {"Location": f"/v1/jobs/{job.id}"})
