"""/v1/jobs/{id}/results and the trajectories of single cases."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from fastapi import APIRouter, Header, Query, Request
from fastapi.concurrency import run_in_threadpool
from starlette.responses import HTMLResponse, Response, StreamingResponse

from engine.basics.problems import Problem, SceneError
from engine.basics.version import version
from service.api.delivery import DOCUMENTED, Answer, delivered, tag_of
from service.api.formats import CONTENT, MEDIA, SUFFIX, chosen, stream
from service.api.jobs import Here, Reader, found
from service.api.problems import Refusal, documented, with_header
from service.api.reading import changes_of, kept_rows, known, rows
from service.api.service import Service
from service.api.waiting import Call, answered
from service.executor.sealed import Spoiled, document_bytes
from service.executor.work import run_trajectory
from service.store.tables import ENDED

router = APIRouter(prefix="/v1/jobs", tags=["results"])
Format = Annotated[Literal["json", "csv", "parquet", "arrow"] | None, Query(description="Instead of the Accept header.")]
Accept = Annotated[str, Header(max_length=1000, include_in_schema=False)]
REPLAY_BYTES = 400_000_000
REPLAYS_AT_ONCE = 4


@router.get(
    "/{job}/results",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "Rows of the cases that are done, in order of cases.",
            "content": CONTENT,
            **with_header("Trunnion-Complete", "Whether these are the rows of all cases: true or false."),
        },
        **DOCUMENTED,
        **documented(404, 406, 416),
    },
)
async def results(
    request: Request,
    job: str,
    caller: Reader,
    s: Here,
    format: Format = None,
    column: Annotated[list[str] | None, Query(description="Only these columns (repeatable).", max_length=1000)] = None,
    first: Annotated[int, Query(ge=0, le=10**12, description="First case.")] = 0,
    count: Annotated[int | None, Query(ge=1, le=10**12, description="Most cases.")] = None,
    accept: Accept = "*/*",
) -> Response:
    """The table with one row for each case. While the job runs it has the rows so far; ``Trunnion-Complete`` says whether they
    are all. Then the answer has an ETag, and parts of it can be asked for with Range; JSON and CSV come compressed to whom that
    suits."""
    kind = chosen(format, accept)
    return await delivered(request, caller.id, s, lambda: _table(s, job, kind, column, first, count))


def _table(s: Service, job: str, kind: str, column: list[str] | None, first: int, count: int | None) -> Answer:
    """The table of a job as it can be sent."""
    there = found(s, job)
    stop = there.cases if count is None else min(there.cases, first + count)
    schema = known(s, job).schema
    names = _columns(schema.names, column)
    headers = {
        "Content-Disposition": f'attachment; filename="{job}.{SUFFIX[kind]}"',
        "Trunnion-Complete": "true" if there.done == there.cases else "false",
    }
    import pyarrow as pa

    about = {"job": job, "request": known(s, job).text}
    shown = pa.schema([schema.field(n) for n in names], metadata=(schema.metadata or {}) | about)

    def make() -> Iterator[bytes]:
        return stream(kind, shown, rows(s, job, shown, first, stop))

    tag = None
    if there.state in ENDED and there.done == there.cases:
        tag = tag_of(job, known(s, job).digest, kind, names, first, stop, there.ends or s.store.ends(job), version())
    return Answer(make, MEDIA[kind], headers, tag)


@router.get(
    "/{job}/trajectories",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "Rows of all cases that are done, in order of cases.",
            "content": CONTENT,
            **with_header("Trunnion-Complete", "Whether these are the rows of all cases: true or false."),
        },
        **DOCUMENTED,
        **documented(404, 406, 409, 416),
    },
)
async def trajectories(
    request: Request,
    job: str,
    caller: Reader,
    s: Here,
    format: Format = None,
    column: Annotated[list[str] | None, Query(description="Only these columns (repeatable).", max_length=1000)] = None,
    first: Annotated[int, Query(ge=0, le=10**12, description="First case.")] = 0,
    count: Annotated[int | None, Query(ge=1, le=10**12, description="Most cases.")] = None,
    accept: Accept = "*/*",
) -> Response:
    """The rows that were kept of every case while it ran (``trajectories`` of the request), as one table with a column ``case``."""
    kind = chosen(format, accept)
    return await delivered(request, caller.id, s, lambda: _rows(s, job, kind, column, first, count))


def _rows(s: Service, job: str, kind: str, column: list[str] | None, first: int, count: int | None) -> Answer:
    """The rows of a job's cases as they can be sent."""
    there = found(s, job)
    series = known(s, job).plan.series
    if series is None:
        raise Refusal(409, "no rows are kept of this job's cases: it was submitted without trajectories")
    stop = there.cases if count is None else min(there.cases, first + count)
    names = _columns(series.schema.names, column)
    headers = {
        "Content-Disposition": f'attachment; filename="{job}-rows.{SUFFIX[kind]}"',
        "Trunnion-Complete": "true" if there.done == there.cases else "false",
    }
    import pyarrow as pa

    about = {"job": job, "request": known(s, job).text}
    shown = pa.schema([series.schema.field(n) for n in names], metadata=(series.schema.metadata or {}) | about)

    def make() -> Iterator[bytes]:
        return stream(kind, shown, kept_rows(s, job, shown, first, stop))

    tag = None
    if there.state in ENDED and there.done == there.cases:
        ends = there.ends or s.store.ends(job)
        tag = tag_of(job, known(s, job).digest + " rows", kind, names, first, stop, ends, version())
    return Answer(make, MEDIA[kind], headers, tag)


def _columns(known: list[str], asked: list[str] | None) -> list[str]:
    """The columns asked for; Refusal (422) for unknown ones."""
    unknown = [c for c in asked or () if c not in known]
    if unknown:
        raise SceneError(
            Problem("column", f"there is no column {c[:200]!r}", f"one of {', '.join(known)[:1000]}") for c in unknown[:50]
        )
    return list(dict.fromkeys(asked)) if asked else known


@router.get(
    "/{job}/cases/{case}/trajectory",
    response_class=StreamingResponse,
    responses={200: {"description": "All rows of one case.", "content": CONTENT}, **documented(404, 406, 409)},
)
async def trajectory(
    job: str,
    case: int,
    caller: Reader,
    s: Here,
    request: Request,
    format: Format = None,
    outputs: Annotated[
        list[str] | None, Query(description="Patterns of columns (repeatable; default: the scene's).", max_length=100)
    ] = None,
    certify: Annotated[bool, Query(description="Whether each column's global error stands beside it (`<column>.error`).")] = False,
    accept: Accept = "*/*",
) -> Response:
    """One case, run again with all its rows: one column for each quantity, one row for each output time. With `certify` a second,
    tighter run states the error of every number, and from when on none is promised (there it is null)."""
    import pyarrow as pa

    kind = chosen(format, accept)
    table = pa.ipc.open_stream(await replayed(s, request, job, case, outputs, "certified" if certify else "table")).read_all()
    headers = {"Content-Disposition": f'attachment; filename="{job}-{case}.{SUFFIX[kind]}"'}
    return StreamingResponse(stream(kind, table.schema, [table]), 200, headers, MEDIA[kind])


@router.get(
    "/{job}/cases/{case}/animation",
    response_class=HTMLResponse,
    responses={
        200: {
            "description": "A page by itself: bodies, contact points, forces.",
            "content": {"text/html": {"schema": {"type": "string"}}},
        },
        **documented(404, 409),
    },
)
async def animation(job: str, case: int, caller: Reader, s: Here, request: Request) -> Response:
    """One case as a moving picture (open it with ``?t=0.5`` to begin at that time)."""
    return HTMLResponse(await replayed(s, request, job, case, None, "animation"))


async def replayed(s: Service, request: Request, job: str, case: int, outputs: list[str] | None, kind: str) -> bytes:
    """What running a case again on the cluster gives, as bytes."""
    digest, changes = await run_in_threadpool(_check, s, job, case, outputs)
    call = Call(run_trajectory, (s.parts.url, job, digest, case, outputs, kind, changes), s.replays, REPLAYS_AT_ONCE, priority=10)
    try:
        return await answered(s, request, s.settings.limits.answer_seconds, call)
    except Spoiled:
        document = await run_in_threadpool(s.store.document, job)
        await run_in_threadpool(s.parts.write, s.parts.job_file(job), document_bytes(document))
        return await answered(s, request, s.settings.limits.answer_seconds, call)


def _check(s: Service, job: str, case: int, outputs: list[str] | None) -> tuple[str, dict[str, float]]:
    """(the digest of the job's document, the case's numbers); Refusal (404, 409) or SceneError when a case cannot be run again."""
    there = found(s, job)
    if not 0 <= case < there.cases:
        raise Refusal(404, f"the job's cases are 0 to {there.cases - 1}")
    if there.started is None:
        raise Refusal(409, "the job has not been started yet")
    changes = changes_of(s, job, case)
    _check_size(s, job, changes, outputs)
    return known(s, job).digest, changes


def _check_size(s: Service, job: str, changes: dict[str, float], outputs: list[str] | None) -> None:
    """SceneError when the rows would be too many, a pattern matches nothing, or the case is no scene."""
    from engine.kernel.columns import columns, select
    from engine.scene.overrides import apply
    from engine.simulation.run import pattern_problems
    from engine.system.build import build

    plan = known(s, job).plan
    scene = apply(plan.scene, changes)
    until, every, _ = plan.run.of(scene)
    everything = columns(build(scene).system)
    problems = pattern_problems(everything, tuple(p[:200] for p in outputs or ()))
    width = 1 + len(select(everything, tuple(outputs or scene.outputs)))
    size = 8 * width * (math.ceil(until / every) if every > 0.0 else 1)
    if size > REPLAY_BYTES:
        problems.append(
            Problem("outputs", f"{size:.3g} bytes are more than the {REPLAY_BYTES:.3g} allowed", "ask for fewer columns")
        )
    if problems:
        raise SceneError(problems)
