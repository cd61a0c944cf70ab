"""/v1/jobs/{id}/bins, /cases/{case}/events and /scene: the cases in bins, the events of a case, the scene as text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf, isnan
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from trunnion.basics.errors import Problem, raise_problems
from trunnion.basics.renamed_words import known_result
from trunnion.batch.sample_statistics.bin_statistics import MOST_BINS, Axis, Bins, Within, binned, picked
from trunnion.scene.file_format.yaml_writer import scene_to_yaml
from trunnion.service.api.documents.problem_documents import content_schema, error_responses
from trunnion.service.api.job_data.job_rows import find_job, job_contents, result_rows
from trunnion.service.api.routes.results_and_trajectories import run_case_again
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import Reader, ServerState
from trunnion.service.api.transport.etag_range_gzip import CONDITIONAL_RESPONSES, Answer, etag_of, respond
from trunnion.service.basics.json_text import text_of
from trunnion.service.store.table_definitions import ENDED

router = APIRouter(prefix="/v1/jobs", tags=["results"])
MOST_WITHIN = 40
MOST_HELD = 5_000_000
"""Largest count of numbers that one request holds in memory."""
WITHIN = "COLUMN=LOW:HIGH, such as joints.ball.friction.mu=0.1:0.3; one limit: max:…=:20; for a text column: outcome=done,stuck"
CELL = list[float | None] | None


class AxisDocument(BaseModel):
    """An axis: bin i is between edges i and i + 1. If the column has few distinct values, ``values`` lists these values, one for
    each bin."""

    name: str
    unit: str
    description: str
    edges: list[float]
    values: list[float] | None


class CellsDocument(BaseModel):
    """The non-empty bins. x, y: indices on the axes. cases: number of cases. first: the first case. outcomes: number of cases by
    outcome. known: number of cases with a value in the column ``of``. least, mean, largest: of these values."""

    x: list[int]
    y: list[int] | None
    cases: list[int]
    first: list[int]
    outcomes: dict[str, list[int]]
    known: list[int] | None
    least: CELL
    mean: CELL
    most: CELL


class BinsDocument(BaseModel):
    """All finished cases of a job, in bins."""

    complete: bool = Field(description="Whether all cases have been run.")
    cases: int = Field(description="Number of cases in the bins.")
    left_out: int = Field(description="Cases excluded by ``within``.")
    missing: dict[str, int] = Field(description="Cases without a value on an axis, by outcome.")
    x: AxisDocument
    y: AxisDocument | None
    of: str | None
    cells: CellsDocument


class CaseEvent(BaseModel):
    """An event of a run."""

    time: float
    kind: str
    joint: str
    text: str


class CaseEnd(BaseModel):
    """The outcome of a run."""

    name: str
    time: float | None
    joint: str
    advice: str


class CaseEvents(BaseModel):
    """The first 2000 events of a case, the number of all events, and the outcome."""

    events: list[CaseEvent]
    count: int
    outcome: CaseEnd


@router.get("/{job}/bins", response_model=BinsDocument, responses={**CONDITIONAL_RESPONSES, **error_responses(404, 416)})
async def get_job_bins(
    request: Request,
    job: str,
    caller: Reader,
    s: ServerState,
    x: Annotated[str, Query(min_length=1, max_length=1000, description="A numeric column.")],
    y: Annotated[str, Query(max_length=1000, description="A second numeric column; default: bins only along x.")] = "",
    of: Annotated[str, Query(max_length=1000, description="A third column; its least, mean and largest value by bin.")] = "",
    nx: Annotated[int, Query(ge=1, le=MOST_BINS, description="Largest number of bins along x.")] = 60,
    ny: Annotated[int, Query(ge=1, le=MOST_BINS, description="Largest number of bins along y.")] = 60,
    within: Annotated[
        list[Annotated[str, Field(max_length=1200)]] | None,
        Query(max_length=MOST_WITHIN, description=f"Count only cases that satisfy this condition (repeatable): {WITHIN}."),
    ] = None,
) -> Response:
    """Count the cases of a job in bins over one or two columns. A column with few distinct values, such as a column of a grid, has
    one bin for each value."""
    read = "if-none-match" not in request.headers
    return await respond(request, caller.id, s, lambda: _bins(s, job, (x, y, of), (nx, ny), within or [], read))


def _bins(s: Service, job: str, named: tuple[str, str, str], most: tuple[int, int], within: list[str], read: bool) -> Answer:
    """The answer with the bins. read: whether the server reads the rows before the response starts. Otherwise, the server reads the
    rows while it sends the response."""
    there, schema = find_job(s, job), job_contents(s, job).schema
    problems: list[Problem] = []
    named = (known_result(named[0], schema.names), known_result(named[1], schema.names), known_result(named[2], schema.names))
    names = {n: _number(schema, where, n, problems) for where, n in zip(("x", "y", "of"), named, strict=True) if n}
    conditions = tuple(w for text in within if (w := _within(schema, text, problems)) is not None)
    raise_problems(problems)

    def counted() -> bytes:
        return text_of(_counted(s, job, named, most, conditions))

    body = counted() if read else b""

    def make() -> Iterator[bytes]:
        yield body or counted()

    tag = None
    if there.state in ENDED and there.done == there.cases:
        tag = etag_of(job, job_contents(s, job).digest + " bins", *named, *most, within, list(names))
    return Answer(make, "application/json", {}, tag)


def _counted(
    s: Service, job: str, named: tuple[str, str, str], most: tuple[int, int], within: tuple[Within, ...]
) -> dict[str, Any]:
    """The document of the bins for the present rows. The rows are scanned twice: first for the axes, then for the bins. Rows that
    do not fit in memory are read again for the second scan."""
    import pyarrow as pa

    schema, there = job_contents(s, job).schema, find_job(s, job)
    x, y, of = named
    wanted = dict.fromkeys([*(n for n in named if n), "case", "outcome", *(w.name for w in within)])
    shown = pa.schema([schema.field(n) for n in wanted])

    def read() -> Iterable[Any]:
        return (picked(table, [n for n in named if n], within) for table in result_rows(s, job, shown, 0, there.cases))

    held = list(read()) if there.cases * len(wanted) <= MOST_HELD else None
    axes = binned((cases for cases, _, _ in (held or read())), x, y, most)
    counted, left_out = Bins(*axes, of), 0
    for cases, outcome, lost in held or read():
        counted.add(cases, outcome)
        left_out += lost
    told = [_axis(schema, a) if a is not None else None for a in axes]
    return {
        "complete": there.done == there.cases, "cases": int(counted.count.sum()), "left_out": left_out,
        "missing": counted.missing, "x": told[0], "y": told[1], "of": of or None, "cells": counted.cells(),
    }  # fmt: skip


def _axis(schema: Any, a: Axis) -> dict[str, Any]:
    about = schema.field(a.name).metadata
    words = {n: about[n.encode()].decode() for n in ("unit", "description")}
    return {"name": a.name, **words, "edges": a.edges.tolist(), "values": None if a.values is None else a.values.tolist()}


def _number(schema: Any, where: str, name: str, problems: list[Problem]) -> str:
    """The name of a numeric column; adds a problem for any other name."""
    numbers = [f.name for f in schema if str(f.type) != "string"]
    if name not in numbers:
        what = "is a text column" if name in schema.names else "is not a column"
        problems.append(Problem(where, f"{name[:200]!r} {what}", f"one of {', '.join(numbers)[:1000]}"))
    return name


def _within(schema: Any, text: str, problems: list[Problem]) -> Within | None:
    """The condition on cases that a text states. For an invalid text, adds a problem and returns None."""
    name, sign, given = text.rpartition("=")
    name = known_result(name, schema.names)
    if not sign or name not in schema.names:
        problems.append(Problem("within", f"{text[:200]!r} does not name a column", WITHIN))
        return None
    if str(schema.field(name).type) == "string":
        return Within(name, words=tuple(given.split(",")))
    low, colon, high = given.partition(":")
    try:
        ends = float(low) if low.strip() else -inf, float(high) if high.strip() else inf
    except ValueError:
        ends = (float("nan"), 0.0)
    if not colon or any(map(isnan, ends)):
        problems.append(Problem("within", f"{text[:200]!r} does not state two limits", WITHIN))
        return None
    return Within(name, *ends)


@router.get("/{job}/cases/{case}/events", response_model=CaseEvents, responses=error_responses(404, 409))
async def get_case_events(job: str, case: int, caller: Reader, s: ServerState, request: Request) -> Response:
    """Run a case again, and return its events and outcome."""
    return Response(await run_case_again(s, request, job, case, None, "events"), media_type="application/json")


@router.get(
    "/{job}/scene",
    response_class=Response,
    responses={
        200: {"description": "YAML text; it loads as the same scene.", **content_schema("application/yaml")},
        **error_responses(404),
    },
)
def get_job_scene(job: str, caller: Reader, s: ServerState) -> Response:
    """Return the scene of a job as YAML. A client can change the scene and submit a new job with it."""
    find_job(s, job)
    said = {"Content-Disposition": f'inline; filename="{job}.yaml"'}
    return Response(scene_to_yaml(job_contents(s, job).plan.scene), 200, said, "application/yaml")
