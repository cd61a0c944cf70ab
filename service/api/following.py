"""/v1/jobs/{id}/rerun and /extend: jobs that follow from others."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool

from service.api.bodies import asks, at_desk, body_of, media_of
from service.api.documents import JobDocument, job_document
from service.api.jobs import PLACE, Here, Submitter, keep
from service.api.keeping import found
from service.api.problems import Json, Refusal, documented
from service.api.reading import known, rows
from service.api.service import Service
from service.desk.following import AgainRequest, MoreRequest
from service.store.rows import Job
from service.store.tables import ENDED

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])
AGAIN: Any = {
    "patience": {"summary": "What ran out of time, with more", "value": {"outcomes": ["out_of_time"], "patience": "5 min"}},
    "all": {"summary": "All that failed, stiffly", "value": {"method": "rosenbrock"}},
}
MORE: Any = {"grid": {"summary": "More values of friction", "value": {"over": {"joints.ball.friction.mu": "0.6:0.9:16"}}}}
ANSWERS: dict[int | str, dict[str, Any]] = {202: {"description": "The new job.", **PLACE}, **documented(404, 409, 413)}


@router.post(
    "/{job}/rerun", status_code=202, response_model=JobDocument, responses=ANSWERS, openapi_extra=asks(AgainRequest, AGAIN)
)
async def rerun(job: str, request: Request, caller: Submitter, s: Here) -> Response:
    """Run the cases of a job that failed again, as a new job (its tag ``of:ID`` names the first), with other settings where
    given."""
    body, about = await body_of(request), (media_of(request), s.settings.limits)
    there = await run_in_threadpool(_ended, s, job)
    seconds = s.settings.limits.check_seconds
    wanted = await at_desk(s.checks, caller, "which", body, *about, seconds=seconds)
    numbers = await s.reads.do(caller.id, lambda: _failed(s, there, wanted))
    document = await run_in_threadpool(s.store.document, job)
    made = await at_desk(s.checks, caller, "plan_again", body, *about, document, numbers, seconds=seconds)
    return await run_in_threadpool(_follows, s, caller, there, made)


@router.post("/{job}/extend", status_code=202, response_model=JobDocument, responses=ANSWERS, openapi_extra=asks(MoreRequest, MORE))
async def extend(job: str, request: Request, caller: Submitter, s: Here) -> Response:
    """Run more cases of the same scene with the same settings, as a new job (its tag ``of:ID`` names the first); cases that the
    first has already are left out."""
    body, limits = await body_of(request), s.settings.limits
    there = await run_in_threadpool(found, s, job)
    document = await run_in_threadpool(s.store.document, job)
    given = (body, media_of(request), limits, document)
    made = await at_desk(s.checks, caller, "plan_more", *given, seconds=limits.check_seconds)
    return await run_in_threadpool(_follows, s, caller, there, made)


def _ended(s: Service, job: str) -> Job:
    there = found(s, job)
    if there.state not in ENDED:
        raise Refusal(409, "the job has not ended")
    return there


def _failed(s: Service, there: Job, wanted: list[str] | None) -> list[int]:
    """The cases to run again: those with the outcomes wanted, and those that have no row; Refusal (409) when there is none."""
    import pyarrow as pa

    schema = known(s, there.id).schema
    shown, has, again = pa.schema([schema.field(n) for n in ("case", "outcome")]), set(), list[int]()
    for table in rows(s, there.id, shown, 0, there.cases):
        for case, outcome in zip(table["case"].to_pylist(), table["outcome"].to_pylist(), strict=True):
            has.add(case)
            if outcome in wanted if wanted is not None else outcome != "done":
                again.append(case)
    again += [i for i in range(there.cases) if i not in has]
    if not again:
        raise Refusal(409, "no case of the job is to be run again")
    return sorted(again)


def _follows(s: Service, caller: Any, there: Job, made: dict[str, Any]) -> Response:
    """Keep a job that follows from another."""
    tags = [*[t for t in made["tags"] if not t.startswith("of:")], f"of:{there.id}"]
    job, _ = keep(s, caller, made | {"tags": tags, "label": made["label"] or there.label}, None)
    return Json(job_document(job), 202, {"Location": f"/v1/jobs/{job.id}"})
