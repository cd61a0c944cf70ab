"""/v1/jobs/{id}/indices, /spreads and /answer: what a sample says of which numbers decide and of how results are spread, what a
study found."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from engine.basics.problems import SceneError
from engine.batch.answers import indices_of, refused, spreads_of
from engine.batch.quantiles import USUAL
from engine.batch.tally import indices_in
from engine.fits.cases import FitPlan
from service.api.answers import StudyAnswer
from service.api.fits import fit_answer
from service.api.jobs import Here, Reader, found
from service.api.problems import Refusal, documented
from service.api.reading import known, rows
from service.api.service import Service
from service.api.tallied import DRAWN, DrawnDocument, drawn_of, of_drawn, rows_drawn, tallied
from service.executor.follows import seen_in
from service.plain import text_of
from service.request import study_of_document
from service.store.tables import ENDED

if TYPE_CHECKING:
    import pyarrow

router = APIRouter(prefix="/v1/jobs", tags=["results"])
Of = Annotated[
    list[Annotated[str, Field(max_length=200)]] | None,
    Query(description="Results, as they were kept (repeatable; default: all).", max_length=100),
]


class EstimateDocument(BaseModel):
    """A number and the interval that holds the true one with the confidence told; null where nothing can be said."""

    value: float | None
    low: float | None
    high: float | None


class OfPath(EstimateDocument):
    """Of one varied number."""

    path: str


class OfPair(EstimateDocument):
    """Of two varied numbers."""

    paths: list[str] = Field(min_length=2, max_length=2)


class IndicesDocument(BaseModel):
    """How far each varied number decides over a result."""

    of: str = Field(description="The result; failed: whether a case did not end as done.")
    unit: str
    points: int
    cases: int
    missing: dict[str, int] = Field(description="Cases without a value, by why.")
    mean: EstimateDocument
    deviation: EstimateDocument
    first: list[OfPath] = Field(description="Part of the variance that goes when the number is known.")
    total: list[OfPath] = Field(description="Part of the variance that stays when all others are known.")
    second: list[OfPair] = Field(description="What two do together, beyond what each does.")
    confidence: float
    notes: list[str]


class IndicesAnswer(BaseModel):
    """Sobol indices of all results asked for, and of failing where some cases failed."""

    complete: bool = Field(description="Whether all cases have been run.")
    indices: list[IndicesDocument]


class Quantile(EstimateDocument):
    """So that the part of the cases that lies below it is the probability."""

    probability: float


class Above(EstimateDocument):
    """How probably a bound is exceeded."""

    bound: float


class SpreadDocument(BaseModel):
    """How a result is spread over the sample."""

    of: str
    unit: str
    cases: int
    missing: int = Field(description="Cases without a value: the intervals hold whatever it would have been.")
    quantiles: list[Quantile]
    above: list[Above]
    confidence: float
    note: str = Field(description="What the intervals mean.")


class SpreadsAnswer(BaseModel):
    """How results are spread."""

    complete: bool = Field(description="Whether all cases have been run.")
    spreads: list[SpreadDocument]
    drawn: DrawnDocument | None = DRAWN


@router.get("/{job}/indices", response_model=IndicesAnswer, responses=documented(404))
async def indices(job: str, caller: Reader, s: Here, of: Of = None) -> Response:
    """Which of the numbers that were sampled decide over the results: Sobol indices, with intervals. The job's sample must have the
    method ``saltelli``. While it runs they are of the points there are."""
    return await s.reads.do(caller.id, lambda: _indices(s, job, of))


def _indices(s: Service, job: str, of: list[str] | None) -> Response:
    there, plan = found(s, job), known(s, job).plan
    names = [n for n in of or [r.name for r in plan.reductions] if n in {r.name for r in plan.reductions}]
    crossed = plan.cases.sampling == "saltelli"
    if crossed and (whole := tallied(s, job)) is not None:
        answer = indices_in(whole, plan.cases, plan.reductions, of or names)
    else:
        table = _table(s, job, names)[0] if crossed else known(s, job).schema.empty_table()
        answer = indices_of(plan.cases, plan.reductions, table, of or names)
    return _json({"complete": there.done == there.cases, "indices": [i.document() for i in answer]})


@router.get("/{job}/spreads", response_model=SpreadsAnswer, responses=documented(404))
async def spreads(
    job: str,
    caller: Reader,
    s: Here,
    of: Of = None,
    at: Annotated[list[float] | None, Query(description="Probabilities of the quantiles (repeatable).", max_length=50)] = None,
    above: Annotated[
        list[Annotated[str, Field(max_length=300)]] | None,
        Query(description="Bounds, as KIND:WHAT=BOUND, units allowed (repeatable).", max_length=50),
    ] = None,
) -> Response:
    """How the results of a sample are spread: quantiles, and how probably bounds are exceeded, with intervals."""
    return await s.reads.do(caller.id, lambda: _spreads(s, job, of, at, above))


def _spreads(s: Service, job: str, of: list[str] | None, at: list[float] | None, above: list[str] | None) -> Response:
    there, plan = found(s, job), known(s, job).plan
    bounds: dict[str, list[str]] = {}
    for text in above or ():
        name, _, value = text.rpartition("=")
        bounds.setdefault(name.strip(), []).append(value.strip())
    names, chosen = list(of or [r.name for r in plan.reductions]), list(at or USUAL)
    if problems := refused(plan.cases, plan.reductions, names, chosen, bounds):
        raise SceneError(problems)
    table, drawn = _table(s, job, [*names, *bounds])
    told = spreads_of(plan.cases, plan.reductions, table, names, chosen, bounds)
    spread = [x.document() | of_drawn(x.note, drawn) for x in told]
    return _json({"complete": there.done == there.cases, "spreads": spread, "drawn": drawn})


@router.get("/{job}/answer", response_model=StudyAnswer, responses=documented(404, 409))
async def answer(job: str, caller: Reader, s: Here) -> Response:
    """What a study (``optimise``, ``refine``) or a ``fit`` has found so far; ``complete`` when there will be no more."""
    return await s.reads.do(caller.id, lambda: _answer(s, job))


def _answer(s: Service, job: str) -> Response:
    there, plan = found(s, job), known(s, job).plan
    if isinstance(plan, FitPlan):
        made = fit_answer(s, job, plan, there.cases)
        return _json({"complete": there.done == there.cases, "ended": there.state in ENDED, "answer": made})
    follow = s.library.follow(job, lambda: study_of_document(s.store.document(job)))
    if follow is None:
        raise Refusal(409, "the job is no study: it was submitted with neither optimise nor refine nor fit")
    digest = known(s, job).digest
    with s.library.following:
        seen = None
        while not follow.over and (seen := seen_in(s.store, s.parts, job, digest, follow)) is not None:
            follow.tell(seen)
        told = {"complete": follow.over, "ended": there.state in ENDED, "answer": follow.answer or None}
    return _json(told)


def _json(data: Any) -> Response:
    return Response(text_of(data), media_type="application/json")


def _table(s: Service, job: str, names: Iterable[str]) -> tuple[pyarrow.Table, dict[str, Any] | None]:
    """The rows of a job so far: their outcomes and some results; of very many those that were drawn, and of how many."""
    import pyarrow as pa

    there, schema, whole = found(s, job), known(s, job).schema, tallied(s, job)
    shown = pa.schema([schema.field(n) for n in dict.fromkeys(("case", "outcome", *names))])
    if whole is not None:
        return rows_drawn(whole, shown), drawn_of(whole)
    return pa.concat_tables([shown.empty_table(), *rows(s, job, shown, 0, there.cases)]), None
