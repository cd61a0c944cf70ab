"""What there is to look at of a job without fetching it whole: its cases in bins, the events of a case, its scene as text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf, isnan
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from engine.basics.problems import Problem, SceneError
from engine.batch.binned import MOST_BINS, Axis, Bins, Within, binned, of_all
from engine.batch.tally import Tally
from engine.scene.dump import scene_to_yaml
from service.api.delivery import DOCUMENTED, Answer, delivered, tag_of
from service.api.jobs import Here, Reader, found
from service.api.problems import documented
from service.api.reading import known, rows
from service.api.results import replayed
from service.api.service import Service
from service.api.tallied import DRAWN, DrawnDocument, drawn_of, rows_drawn, tallied
from service.plain import text_of
from service.store.tables import ENDED

router = APIRouter(prefix="/v1/jobs", tags=["results"])
MOST_WITHIN = 40
MOST_HELD = 5_000_000
"""Numbers kept in memory while one request is answered."""
WITHIN = "such as joints.ball.friction.mu=0.1:0.3, max:…=:20 for one end, outcome=done,stuck for words"
CELL = list[float | None] | None


class AxisDocument(BaseModel):
    """An axis: bin i is from edge i to edge i + 1; where there are few numbers, ``values`` are these, one a bin."""

    name: str
    unit: str
    description: str
    edges: list[float]
    values: list[float] | None


class CellsDocument(BaseModel):
    """The bins that hold a case, side by side: places on the axes, cases, the first case of each, cases by outcome; of ``of`` how
    many have a value, and which."""

    x: list[int]
    y: list[int] | None
    cases: list[int]
    first: list[int]
    outcomes: dict[str, list[int]]
    known: list[int] | None
    least: CELL
    mean: CELL
    most: CELL


class ColumnDocument(BaseModel):
    """A column over all cases that are done: how many have a number, the least, the mean and the largest."""

    known: int
    least: float | None
    mean: float | None
    most: float | None


class BinsDocument(BaseModel):
    """All cases of a job that are done, in bins."""

    complete: bool = Field(description="Whether all cases have been run.")
    cases: int = Field(description="Counted in bins.")
    left_out: int = Field(description="By ``within``.")
    missing: dict[str, int] = Field(description="Without a number of an axis, by outcome.")
    x: AxisDocument
    y: AxisDocument | None
    of: str | None
    cells: CellsDocument
    drawn: DrawnDocument | None = DRAWN
    whole: dict[str, ColumnDocument] | None = Field(None, description="Where cases are drawn: the columns over all cases, exactly.")


class CaseEvent(BaseModel):
    """Something that happened in a run."""

    time: float
    kind: str
    joint: str
    text: str


class CaseEnd(BaseModel):
    """How a run ended."""

    name: str
    time: float | None
    joint: str
    advice: str


class CaseEvents(BaseModel):
    """The first 2000 events of a case, all there were, and how it ended."""

    events: list[CaseEvent]
    count: int
    outcome: CaseEnd


@router.get("/{job}/bins", response_model=BinsDocument, responses={**DOCUMENTED, **documented(404, 416)})
async def bins(
    request: Request,
    job: str,
    caller: Reader,
    s: Here,
    x: Annotated[str, Query(min_length=1, max_length=1000, description="A column of numbers.")],
    y: Annotated[str, Query(max_length=1000, description="Another; none: bins along x alone.")] = "",
    of: Annotated[str, Query(max_length=1000, description="A third, whose least, mean and largest value each bin has.")] = "",
    nx: Annotated[int, Query(ge=1, le=MOST_BINS, description="Most bins along x.")] = 60,
    ny: Annotated[int, Query(ge=1, le=MOST_BINS, description="Most bins along y.")] = 60,
    within: Annotated[
        list[Annotated[str, Field(max_length=1200)]] | None,
        Query(max_length=MOST_WITHIN, description=f"Only cases of which this holds (repeatable): {WITHIN}."),
    ] = None,
) -> Response:
    """All cases of a job, however many, in bins over one or two columns: what a picture of a million cases is drawn from. A column
    with few numbers (a grid's) has a bin for each."""
    read = "if-none-match" not in request.headers
    return await delivered(request, caller.id, s, lambda: _bins(s, job, (x, y, of), (nx, ny), within or [], read))


def _bins(s: Service, job: str, named: tuple[str, str, str], most: tuple[int, int], within: list[str], read: bool) -> Answer:
    """Bins as they can be sent. read: whether they are counted at once."""
    there, schema = found(s, job), known(s, job).schema
    problems: list[Problem] = []
    names = {n: _number(schema, where, n, problems) for where, n in zip(("x", "y", "of"), named, strict=True) if n}
    conditions = tuple(w for text in within if (w := _within(schema, text, problems)) is not None)
    if problems:
        raise SceneError(problems)

    def counted() -> bytes:
        return text_of(_counted(s, job, named, most, conditions))

    body = counted() if read else b""

    def make() -> Iterator[bytes]:
        yield body or counted()

    tag = None
    if there.state in ENDED and there.done == there.cases:
        tag = tag_of(job, known(s, job).digest + " bins", *named, *most, within, list(names))
    return Answer(make, "application/json", {}, tag)


def _counted(
    s: Service, job: str, named: tuple[str, str, str], most: tuple[int, int], within: tuple[Within, ...]
) -> dict[str, Any]:
    """The document of all rows there are now: looked at twice, for the ends of the axes and for the bins; read twice where they are
    too many to be kept between. Of very many cases some rows were drawn when they were run."""
    import pyarrow as pa

    schema, there, whole = known(s, job).schema, found(s, job), tallied(s, job)
    x, y, of = named
    wanted = dict.fromkeys([*(n for n in named if n), "case", "outcome", *(w.name for w in within)])
    shown = pa.schema([schema.field(n) for n in wanted])

    def read() -> Iterable[Any]:
        tables = rows(s, job, shown, 0, there.cases) if whole is None else iter([rows_drawn(whole, shown)])
        return of_all(tables, within, named)

    held = list(read()) if whole is not None or there.cases * len(wanted) <= MOST_HELD else None
    ends = {n: e for n in (x, y) if whole is not None and not within and n and (e := whole.ends(n))}
    axes = binned((cases for cases, _, _ in (held or read())), x, y, most, ends)
    counted, left_out = Bins(*axes, of), 0
    for cases, outcome, lost in held or read():
        counted.add(cases, outcome)
        left_out += lost
    told = [_axis(schema, a) if a is not None else None for a in axes]
    return {
        "complete": there.done == there.cases, "cases": int(counted.count.sum()), "left_out": left_out,
        "missing": counted.missing, "x": told[0], "y": told[1], "of": of or None, "cells": counted.cells(),
        "drawn": drawn_of(whole), "whole": {n: _column(whole, n) for n in named if n} if whole is not None else None,
    }  # fmt: skip


def _column(whole: Tally, name: str) -> dict[str, Any]:
    low, high = whole.ends(name) or (None, None)
    return {"known": int(whole.known[whole.names.index(name)]), "least": low, "mean": whole.mean(name), "most": high}


def _axis(schema: Any, a: Axis) -> dict[str, Any]:
    about = schema.field(a.name).metadata
    words = {n: about[n.encode()].decode() for n in ("unit", "description")}
    return {"name": a.name, **words, "edges": a.edges.tolist(), "values": None if a.values is None else a.values.tolist()}


def _number(schema: Any, where: str, name: str, problems: list[Problem]) -> str:
    """A column of numbers; what is none is a problem."""
    numbers = [f.name for f in schema if str(f.type) != "string"]
    if name not in numbers:
        what = "is a column of words" if name in schema.names else "is no column"
        problems.append(Problem(where, f"{name[:200]!r} {what}", f"one of {', '.join(numbers)[:1000]}"))
    return name


def _within(schema: Any, text: str, problems: list[Problem]) -> Within | None:
    """A condition as it is written; None, and a problem, where it is none."""
    name, sign, given = text.rpartition("=")
    if not sign or name not in schema.names:
        problems.append(Problem("within", f"{text[:200]!r} names no column", WITHIN))
        return None
    if str(schema.field(name).type) == "string":
        return Within(name, words=tuple(given.split(",")))
    low, colon, high = given.partition(":")
    try:
        ends = float(low) if low.strip() else -inf, float(high) if high.strip() else inf
    except ValueError:
        ends = (float("nan"), 0.0)
    if not colon or any(map(isnan, ends)):
        problems.append(Problem("within", f"{text[:200]!r} gives no two ends", WITHIN))
        return None
    return Within(name, *ends)


@router.get("/{job}/cases/{case}/events", response_model=CaseEvents, responses=documented(404, 409))
async def case_events(job: str, case: int, caller: Reader, s: Here, request: Request) -> Response:
    """What happened in one case, run again: its events with their times, and how it ended."""
    return Response(await replayed(s, request, job, case, None, "events"), media_type="application/json")


@router.get(
    "/{job}/scene",
    response_class=Response,
    responses={
        200: {
            "description": "YAML, which loads back to the same scene.",
            "content": {"application/yaml": {"schema": {"type": "object"}}},
        },
        **documented(404),
    },
)
def job_scene(job: str, caller: Reader, s: Here) -> Response:
    """The scene of a job as YAML text, to be changed and submitted again."""
    found(s, job)
    said = {"Content-Disposition": f'inline; filename="{job}.yaml"'}
    return Response(scene_to_yaml(known(s, job).plan.scene), 200, said, "application/yaml")
