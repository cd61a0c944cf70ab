"""/v1/jobs/{id}/results, /trajectories, /cases/{case}/trajectory and /cases/{case}/animation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Header, Query, Request
from fastapi.concurrency import run_in_threadpool
from starlette.responses import HTMLResponse, Response, StreamingResponse

from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.renamed_words import known_result
from trunnion.basics.version import version
from trunnion.service.api.documents.problem_documents import Refusal, content_schema, error_responses, header_schema
from trunnion.service.api.job_data.job_rows import case_numbers, find_job, job_contents, result_rows, trajectory_rows
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import Reader, ServerState
from trunnion.service.api.transport.cluster_calls import call_cluster
from trunnion.service.api.transport.etag_range_gzip import CONDITIONAL_RESPONSES, Answer, etag_of, respond
from trunnion.service.api.transport.table_formats import CONTENT, MEDIA, SUFFIX, choose_format, table_bytes
from trunnion.service.executor.chunk_and_case_runs import run_trajectory
from trunnion.service.executor.part_file_format import CorruptPart, document_bytes
from trunnion.service.store.table_definitions import ENDED

router = APIRouter(prefix="/v1/jobs", tags=["results"])
Format = Annotated[Literal["json", "csv", "parquet", "arrow"] | None, Query(description="Format; overrides the Accept header.")]
Accept = Annotated[str, Header(max_length=1000, include_in_schema=False)]
REPLAY_BYTES = 400_000_000
REPLAYS_AT_ONCE = 4


@dataclass(frozen=True)
class RowQuery:
    """The requested rows and columns of a job, and the format."""

    format: Format = None
    column: Annotated[list[str] | None, Query(description="Only these columns (repeatable).", max_length=1000)] = None
    first: Annotated[int, Query(ge=0, le=10**12, description="First case.")] = 0
    count: Annotated[int | None, Query(ge=1, le=10**12, description="Largest number of cases.")] = None
    accept: Accept = "*/*"


Rows = Annotated[RowQuery, Depends()]


def _row_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The documented responses of an operation that returns rows of a job. statuses: further error statuses."""
    complete = header_schema("Trunnion-Complete", "true if all cases have rows, false if some are still missing.")
    rows = {"description": "Rows of the finished cases, in order of cases.", "content": CONTENT, **complete}
    return {200: rows, **CONDITIONAL_RESPONSES, **error_responses(404, 406, 416, *statuses)}


@router.get("/{job}/results", response_class=StreamingResponse, responses=_row_responses())
async def get_job_results(request: Request, job: str, caller: Reader, s: ServerState, query: Rows) -> Response:
    """Return the table of results with one row for each finished case. The header ``Trunnion-Complete`` tells whether all rows are
    included. A complete table has an ETag and supports Range requests. JSON and CSV are compressed for clients that accept gzip."""
    kind = choose_format(query.format, query.accept)
    return await respond(request, caller.id, s, lambda: _rows_answer(s, job, kind, query, kept=False))


@router.get("/{job}/trajectories", response_class=StreamingResponse, responses=_row_responses(409))
async def get_job_trajectories(request: Request, job: str, caller: Reader, s: ServerState, query: Rows) -> Response:
    """Return the stored trajectory rows of all cases as one table with a column ``case``. The field ``trajectories`` of the job's
    request selects the stored rows."""
    kind = choose_format(query.format, query.accept)
    return await respond(request, caller.id, s, lambda: _rows_answer(s, job, kind, query, kept=True))


def _rows_answer(s: Service, job: str, kind: str, query: RowQuery, kept: bool) -> Answer:
    """The answer with rows of a job: one row for each case or, with ``kept``, the stored trajectory rows of all cases. Refusal
    (409) if the job stores no trajectory rows."""
    import pyarrow as pa

    record, contents = find_job(s, job), job_contents(s, job)
    series, schema, read = contents.plan.series, contents.schema, result_rows
    if kept:
        if series is None:
            raise Refusal(409, "this job stores no rows of its cases, because it was submitted without trajectories")
        schema, read = series.schema, trajectory_rows
    first, stop = query.first, record.cases if query.count is None else min(record.cases, query.first + query.count)
    names, mark, complete = _columns(schema.names, query.column), "rows" if kept else "", record.done == record.cases
    about = {"job": job, "request": contents.text}
    shown = pa.schema([schema.field(n) for n in names], metadata=(schema.metadata or {}) | about)
    file = f"{job}-{mark}" if mark else job
    headers = {
        "Content-Disposition": f'attachment; filename="{file}.{SUFFIX[kind]}"',
        "Trunnion-Complete": "true" if complete else "false",
    }

    def make() -> Iterator[bytes]:
        return table_bytes(kind, shown, read(s, job, shown, first, stop))

    tag = None
    if record.state in ENDED and complete:
        tag = etag_of(job, contents.digest, mark, kind, names, first, stop, record.ends or s.store.ends(job), version())
    return Answer(make, MEDIA[kind], headers, tag)


def _columns(known: list[str], asked: list[str] | None) -> list[str]:
    """The requested columns, by default all columns; SceneError for unknown columns."""
    asked = [known_result(c, known) for c in asked or ()]
    unknown = [c for c in asked if c not in known]
    if unknown:
        hint = f"one of {', '.join(known)[:1000]}"
        raise SceneError(Problem("column", f"there is no column {c[:200]!r}", hint) for c in unknown[:50])
    return list(dict.fromkeys(asked)) if asked else known


@router.get(
    "/{job}/cases/{case}/trajectory",
    response_class=StreamingResponse,
    responses={200: {"description": "All rows of one case.", "content": CONTENT}, **error_responses(404, 406, 409)},
)
async def get_case_trajectory(
    job: str,
    case: int,
    caller: Reader,
    s: ServerState,
    request: Request,
    format: Format = None,
    outputs: Annotated[
        list[str] | None, Query(description="Patterns of columns (repeatable; default: the scene's).", max_length=100)
    ] = None,
    certify: Annotated[bool, Query(description="Add the global error of each column (`<column>.error`).")] = False,
    accept: Accept = "*/*",
) -> Response:
    """Run a case again and return all its rows: one column for each quantity, one row for each output time. With ``certify``, a
    second run with a tighter tolerance estimates the error of every value. An error of null means that there is no estimate."""
    import pyarrow as pa

    kind = choose_format(format, accept)
    table = pa.ipc.open_stream(await run_case_again(s, request, job, case, outputs, "certified" if certify else "table")).read_all()
    headers = {"Content-Disposition": f'attachment; filename="{job}-{case}.{SUFFIX[kind]}"'}
    return StreamingResponse(table_bytes(kind, table.schema, [table]), 200, headers, MEDIA[kind])


@router.get(
    "/{job}/cases/{case}/animation",
    response_class=HTMLResponse,
    responses={
        200: {"description": "A self-contained page: bodies, contact points, forces.", **content_schema("text/html", "string")},
        **error_responses(404, 409),
    },
)
async def get_case_animation(job: str, case: int, caller: Reader, s: ServerState, request: Request) -> Response:
    """Return an animation of a case. With ``?t=0.5``, the animation starts at 0.5 s."""
    return HTMLResponse(await run_case_again(s, request, job, case, None, "animation"))


async def run_case_again(s: Service, request: Request, job: str, case: int, outputs: list[str] | None, kind: str) -> bytes:
    """Run a case again on the cluster and return the bytes of the result. kind: as for ``run_trajectory``."""
    digest, changes = await run_in_threadpool(_check, s, job, case, outputs)
    given = (run_trajectory, s.parts.url, job, digest, case, outputs, kind, changes)
    call = partial(call_cluster, s, request, s.settings.limits.answer_seconds, s.replays, REPLAYS_AT_ONCE, *given, priority=10)
    try:
        return await call()
    except CorruptPart:
        document = await run_in_threadpool(s.store.document, job)
        await run_in_threadpool(s.parts.write, s.parts.job_file(job), document_bytes(document))
        return await call()


def _check(s: Service, job: str, case: int, outputs: list[str] | None) -> tuple[str, dict[str, float]]:
    """(digest of the job's document, parameter values of the case). Refusal (404, 409) or SceneError when the case cannot run
    again."""
    there = find_job(s, job)
    if not 0 <= case < there.cases:
        raise Refusal(404, f"the job's cases are 0 to {there.cases - 1}")
    if there.started is None:
        raise Refusal(409, "the job has not been started yet")
    changes = case_numbers(s, job, case)
    _check_size(s, job, changes, outputs)
    return job_contents(s, job).digest, changes


def _check_size(s: Service, job: str, changes: dict[str, float], outputs: list[str] | None) -> None:
    """Raise SceneError when there are too many rows, a pattern matches no column, or the scene of the case is invalid."""
    from trunnion.kernel.interface.output_columns import columns, select
    from trunnion.scene.overrides import apply
    from trunnion.simulation.run import pattern_problems
    from trunnion.system.construction.system_builder import build

    plan = job_contents(s, job).plan
    scene = apply(plan.scene, changes)
    until, every, _ = plan.run.of(scene)
    everything = columns(build(scene).system)
    problems = pattern_problems(everything, tuple(p[:200] for p in outputs or ()))
    width = 1 + len(select(everything, tuple(outputs or scene.outputs)))
    size = 8 * width * (math.ceil(until / every) if every > 0.0 else 1)
    if size > REPLAY_BYTES:
        problems.append(
            Problem("outputs", f"{size:.3g} bytes are more than the {REPLAY_BYTES:.3g} allowed", "request fewer columns")
        )
    raise_problems(problems)
