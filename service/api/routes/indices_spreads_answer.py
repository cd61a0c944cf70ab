"""/v1/jobs/{id}/indices, /spreads and /answer: sensitivity indices, quantiles, results of studies and fits."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from trunnion.analysis.fits.fits_as_batch_cases import FitPlan
from trunnion.analysis.studies.study_rounds import StudyProgress
from trunnion.basics.errors import raise_problems
from trunnion.batch.sample_statistics.quantiles_and_probabilities import USUAL
from trunnion.batch.sample_statistics.result_queries import indices_of, refused, spreads_of
from trunnion.service.api.documents.fit_and_study_answers import StudyAnswer, fit_answer
from trunnion.service.api.documents.problem_documents import Json, Refusal, error_responses
from trunnion.service.api.job_data.job_rows import find_job, job_contents, result_rows
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import Reader, ServerState
from trunnion.service.executor.study_round_results import round_results
from trunnion.service.request_models.job_request import study_of_document
from trunnion.service.store.table_definitions import ENDED

if TYPE_CHECKING:
    import pyarrow

MOST_CASES = 2_000_000
"""Largest number of cases from which indices and quantiles are computed. Only the first cases of a larger job are used, because the
first points of a sample are also a sample."""
router = APIRouter(prefix="/v1/jobs", tags=["results"])
Of = Annotated[
    list[Annotated[str, Field(max_length=200)]] | None,
    Query(description="Results of the job (repeatable; default: all).", max_length=100),
]


class DrawnDocument(BaseModel):
    """The part of a job from which an answer was computed: its first cases."""

    cases: int = Field(description="Number of used cases, which are the first finished cases.")
    of: int = Field(description="Number of finished cases.")


DRAWN = Field(None, description=f"null: the answer covers all cases. In a larger job, it covers the first {MOST_CASES} cases.")


class EstimateDocument(BaseModel):
    """An estimate with its confidence interval; null means undetermined."""

    value: float | None
    low: float | None
    high: float | None


class OfPath(EstimateDocument):
    """An estimate for one varied number."""

    path: str


class OfPair(EstimateDocument):
    """An estimate for two varied numbers."""

    paths: list[str] = Field(min_length=2, max_length=2)


class IndicesDocument(BaseModel):
    """Sobol indices of a result."""

    of: str = Field(description="Name of the result. The result `failed` is 1 for a case with an outcome other than done, else 0.")
    unit: str
    points: int
    cases: int
    missing: dict[str, int] = Field(description="Cases without a value, by reason.")
    mean: EstimateDocument
    deviation: EstimateDocument
    first: list[OfPath] = Field(description="First-order index: share of the variance that is due to this number alone.")
    total: list[OfPath] = Field(
        description="Total index: share of the variance due to this number alone and to its interactions with other numbers."
    )
    second: list[OfPair] = Field(description="Second-order index: share of the variance due to the interaction of two numbers.")
    confidence: float
    notes: list[str]


class IndicesAnswer(BaseModel):
    """Sobol indices of the requested results and, if some cases failed, of failure."""

    complete: bool = Field(description="Whether all cases have been run.")
    indices: list[IndicesDocument]
    drawn: DrawnDocument | None = DRAWN


class Quantile(EstimateDocument):
    """A quantile of a result."""

    probability: float


class Above(EstimateDocument):
    """The probability that a result exceeds a bound."""

    bound: float


class SpreadDocument(BaseModel):
    """The distribution of a result over the sample."""

    of: str
    unit: str
    cases: int
    missing: int = Field(description="Number of cases without a value. The intervals are valid for any values of these cases.")
    quantiles: list[Quantile]
    above: list[Above]
    confidence: float
    note: str = Field(description="What the intervals mean.")


class SpreadsAnswer(BaseModel):
    """Distributions of results."""

    complete: bool = Field(description="Whether all cases have been run.")
    spreads: list[SpreadDocument]
    drawn: DrawnDocument | None = DRAWN


@router.get("/{job}/indices", response_model=IndicesAnswer, responses=error_responses(404))
async def get_job_indices(job: str, caller: Reader, s: ServerState, of: Of = None) -> Response:
    """Return Sobol indices of the results with respect to the sampled numbers, with confidence intervals. The sample must use the
    method ``saltelli``. For a running job, the indices are computed from the finished points."""
    return await s.reads.run(caller.id, lambda: _indices(s, job, of))


def _indices(s: Service, job: str, of: list[str] | None) -> Response:
    there, plan = find_job(s, job), job_contents(s, job).plan
    names = [n for n in of or [r.name for r in plan.reductions] if n in {r.name for r in plan.reductions}]
    crossed = plan.cases.sampling == "saltelli"
    table, drawn = _table(s, job, names) if crossed else (job_contents(s, job).schema.empty_table(), None)
    answer = indices_of(plan.cases, plan.reductions, table, of or names)
    return Json({"complete": there.done == there.cases, "indices": [i.document() for i in answer], "drawn": drawn})


@router.get("/{job}/spreads", response_model=SpreadsAnswer, responses=error_responses(404))
async def get_job_spreads(
    job: str,
    caller: Reader,
    s: ServerState,
    of: Of = None,
    at: Annotated[list[float] | None, Query(description="Probabilities of the quantiles (repeatable).", max_length=50)] = None,
    above: Annotated[
        list[Annotated[str, Field(max_length=300)]] | None,
        Query(description="Bounds, as KIND:WHAT=BOUND, units allowed (repeatable).", max_length=50),
    ] = None,
) -> Response:
    """Return quantiles of the results of a sample and the probabilities that results exceed bounds, with confidence intervals."""
    return await s.reads.run(caller.id, lambda: _spreads(s, job, of, at, above))


def _spreads(s: Service, job: str, of: list[str] | None, at: list[float] | None, above: list[str] | None) -> Response:
    there, plan = find_job(s, job), job_contents(s, job).plan
    bounds: dict[str, list[str]] = {}
    for text in above or ():
        name, _, value = text.rpartition("=")
        bounds.setdefault(name.strip(), []).append(value.strip())
    names, chosen = list(of or [r.name for r in plan.reductions]), list(at or USUAL)
    raise_problems(refused(plan.cases, plan.reductions, names, chosen, bounds))
    table, drawn = _table(s, job, [*names, *bounds])
    told = spreads_of(plan.cases, plan.reductions, table, names, chosen, bounds)
    return Json({"complete": there.done == there.cases, "spreads": [x.document() for x in told], "drawn": drawn})


@router.get("/{job}/answer", response_model=StudyAnswer, responses=error_responses(404, 409))
async def get_job_answer(job: str, caller: Reader, s: ServerState) -> Response:
    """Return the result of a study (``optimise``, ``refine``) or a ``fit``. ``complete`` states whether the result is final."""
    return await s.reads.run(caller.id, lambda: _answer(s, job))


def _answer(s: Service, job: str) -> Response:
    there, plan = find_job(s, job), job_contents(s, job).plan
    if isinstance(plan, FitPlan):
        made = fit_answer(s, job, plan, there.cases)
        return Json({"complete": there.done == there.cases, "ended": there.state in ENDED, "answer": made})
    follow, digest = s.studies.of(job, lambda: _begun_study(s, job)), job_contents(s, job).digest
    with s.study_lock:
        seen = None
        while not follow.is_over and (seen := round_results(s.store, s.parts, job, digest, follow)) is not None:
            follow.report(seen)
        told = {"complete": follow.is_over, "ended": there.state in ENDED, "answer": follow.answer or None}
    return Json(told)


def _begun_study(s: Service, job: str) -> StudyProgress:
    """The study of a job before its first round. Refusal (409) for a job without a study."""
    study = study_of_document(s.store.document(job))
    if study is None:
        raise Refusal(409, "the job has no answer, because it was submitted without optimise, refine or fit")
    return StudyProgress(study)


def _table(s: Service, job: str, names: Iterable[str]) -> tuple[pyarrow.Table, dict[str, int] | None]:
    """(rows, ``DrawnDocument``). The rows hold the outcomes and the named results of a job's finished cases. If the job has more
    than MOST_CASES cases, only its first MOST_CASES cases are read. The document is None if all cases are read."""
    import pyarrow as pa

    there, schema = find_job(s, job), job_contents(s, job).schema
    shown = pa.schema([schema.field(n) for n in dict.fromkeys(("case", "outcome", *names))])
    table = pa.concat_tables([shown.empty_table(), *result_rows(s, job, shown, 0, min(there.cases, MOST_CASES))])
    return table, {"cases": len(table), "of": there.done} if there.cases > MOST_CASES else None
